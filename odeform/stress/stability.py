"""Stability plot: deformation over two parameters and time, inside the trained box and beyond."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from PIL import Image, ImageDraw
from scipy.spatial import KDTree

from odeform.models.base import Predictor
from odeform.schema import Parameter
from odeform.stress.cases import inside
from odeform.types import Floats, Times

__all__ = ["StabilityMap", "largest_deformation", "map_image", "refined_map", "stability_map"]

MOTIONS = 32  # of the trained box, that tell how large deformations are
LEVELS = (3, 5, 9, 17)  # values of each parameter, from coarse to fine; each holds those before
MOMENTS = (0.5, 1.0, 1.5, 3.0, 10.0)
SIDE, GAP = 200, 24  # pixels, about, of one panel and between two
SCALE = np.array([[247, 247, 242], [253, 212, 120], [240, 120, 60], [170, 20, 60]], dtype=float)
FAILED = (60, 60, 60)


@dataclass(frozen=True, eq=False)
class StabilityMap:
    """RMS deformation over two parameters and time; all other parameters have their defaults.

    `values[t, i, j]` is relative to the largest in the trained box, with the first of `names` at `units[j]` and the
    second at `units[i]` (halves of the trained range, from its middle), at `times[t]` seconds. `window` is the trained
    one, in seconds. `sound` is False where an earlier state is shown: the integration failed, or the motion is stopped.
    """

    names: tuple[str, str]
    units: Float[np.ndarray, " units"]
    times: Times
    window: float
    values: Float[np.ndarray, "times units units"]
    sound: Bool[np.ndarray, "times units units"]
    boxes: tuple[str, str]
    """The trained range of each parameter, with its unit."""
    largest: float
    """m: the deformation that `values` are relative to."""
    solved: int
    """The motions that it is made from; where they are fewer than its cells, the nearest one stands for others."""


def largest_deformation(predictor: Predictor) -> float:
    """Returns the largest RMS deformation in metres of random motions of the trained box, within the trained window."""
    times = predictor.schema.window.times
    motions = (predictor.solve(None, parameters) for parameters in inside(predictor.schema, MOTIONS, 0))
    return max(float(motion.deformation_rms(times).max()) for motion in motions)


def stability_map(
    predictor: Predictor,
    names: tuple[str, str] | None = None,
    scale: float = 3.0,
    count: int = 25,
    moments: tuple[float, ...] = MOMENTS,
    report: Callable[[float], None] = lambda _: None,
) -> StabilityMap:
    """Solve `count` x `count` values of two parameters (default: the first two), up to `scale` times the trained box.

    `moments` are the times, in trained windows; `report` is told the fraction that is done.
    """
    schema = predictor.schema
    known = {p.name: p for p in schema.learned}
    first, second = (known[name] for name in names or list(known)[:2])
    times = schema.window.stop * np.array(moments)
    units = np.linspace(-scale, scale, count)
    values, sound = np.empty((len(times), count, count)), np.empty((len(times), count, count), dtype=bool)
    for i, j in np.ndindex(count, count):
        given = {first.name: first.denormalise(float(units[j])), second.name: second.denormalise(float(units[i]))}
        values[:, i, j], sound[:, i, j] = _cell(predictor, given, times)
        report((i * count + j + 1) / (count * count))
    largest = largest_deformation(predictor)
    return _map_of((first, second), units, times, predictor, values / largest, sound, largest, count * count)


def refined_map(
    predictor: Predictor,
    seconds: float,
    scale: float = 3.0,
    moments: tuple[float, ...] = (0.5, 1.0, 2.0),
    report: Callable[[float], None] = lambda _: None,
) -> StabilityMap:
    """The map of the first two parameters, as fine as `seconds` of work allow: coarse first, then between.

    It is relative to the largest deformation in its own trained box. `report` is told the fraction of the time.
    """
    begin, schema = time.monotonic(), predictor.schema
    first, second = schema.learned[:2]
    times = schema.window.stop * np.array(moments)
    count, known = LEVELS[-1], {}
    units = np.linspace(-scale, scale, count)
    step = count - 1
    for level in LEVELS:
        begun = time.monotonic() - begin
        if known and begun >= seconds:
            break
        step = (count - 1) // (level - 1)
        for i, j in np.ndindex(level, level):
            cell = (i * step, j * step)
            spent = time.monotonic() - begin
            if cell in known or (level > LEVELS[0] and spent >= seconds):
                continue
            given = {
                first.name: first.denormalise(float(units[cell[1]])),
                second.name: second.denormalise(float(units[cell[0]])),
            }
            known[cell] = _cell(predictor, given, times)
            report(min(spent / seconds, 1.0) if seconds > 0.0 else 1.0)
    at = np.array(list(known))
    shown = np.stack(np.meshgrid(*2 * [np.arange(0, count, step)], indexing="ij"), axis=-1)
    nearest = np.atleast_1d(KDTree(at).query(shown.reshape(-1, 2))[1])
    found = list(known.values())
    values, sound = (
        np.stack([found[index][part] for index in nearest], axis=1).reshape(len(times), *shown.shape[:2])
        for part in (0, 1)
    )
    inside = np.abs(units[::step]) <= 1.0
    largest = float(values[times <= schema.window.stop][:, inside][:, :, inside].max())
    return _map_of((first, second), units[::step], times, predictor, values / largest, sound, largest, len(known))


def _cell(predictor: Predictor, given: dict[str, float], times: Times) -> tuple[Times, Bool[np.ndarray, " times"]]:
    """RMS deformations of one motion in m, and whether they are its own."""
    motion = predictor.solve(None, given, until=times[-1])
    values = motion.deformation_rms(times)
    solved = predictor.schema.window.soft_clamped(times) <= motion.last_good
    return values, solved & [motion.stop_at(moment) is None for moment in times.tolist()]


def _map_of(
    parameters: tuple[Parameter, Parameter],
    units: Floats,
    times: Times,
    predictor: Predictor,
    values: Floats,
    sound: Bool[np.ndarray, "times units units"],
    largest: float,
    solved: int,
) -> StabilityMap:
    first, second = parameters
    boxes = (_range(first), _range(second))
    window = predictor.schema.window.stop
    return StabilityMap((first.name, second.name), units, times, window, values, sound, boxes, largest, solved)


def _range(parameter: Parameter) -> str:
    return f"{parameter.low:.3g} to {parameter.high:.3g} {parameter.unit}"


def map_image(plot: StabilityMap) -> Image.Image:
    """One panel per time, grey where an earlier state is shown."""
    side = SIDE // len(plot.units) * len(plot.units)
    image = Image.new("RGB", (GAP + len(plot.times) * (side + GAP), side + 3 * GAP), (255, 255, 255))
    case = ImageDraw.Draw(image)
    axes = f"x: {plot.names[0]} ({plot.boxes[0]}), y: {plot.names[1]} ({plot.boxes[1]})"
    for index, moment in enumerate(plot.times):
        left = GAP + index * (side + GAP)
        cells = np.where(plot.sound[index][..., None], _colors(plot.values[index]), FAILED).astype(np.uint8)
        panel = Image.fromarray(cells[::-1]).resize((side, side), Image.Resampling.NEAREST)
        image.paste(panel, (left, GAP))
        scale = plot.units[-1] + 0.5 * (plot.units[1] - plot.units[0])
        low, high = (0.5 * side * (1.0 + end / scale) for end in (-1.0, 1.0))
        case.rectangle((left + low, GAP + low, left + high, GAP + high), outline=(0, 0, 0))
        windows = moment / plot.window
        caption = f"{moment:.3g} s ({windows:g} trained window{'' if windows == 1.0 else 's'})"
        case.text((left, 6), caption, fill=(0, 0, 0))
        case.text((left, side + GAP + 4), axes, fill=(0, 0, 0))
    text = (
        "RMS deformation over the largest trained: 0 (pale), 1 (orange), 2 or more (dark red). Frame: the trained box"
    )
    case.text((GAP, side + 2 * GAP), f"{text}; map spans {plot.units[-1]:g}x the trained range", fill=(0, 0, 0))
    return image


def _colors(values: Floats) -> Floats:
    at = np.clip(values, 0.0, 2.0) / 2.0 * (len(SCALE) - 1)
    return np.stack([np.interp(at, np.arange(len(SCALE)), channel) for channel in SCALE.T], axis=-1)
