"""A data set of arrays in memory: what a program has simulated or captured itself."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from odeform.dataset.arrays import checked_sequence
from odeform.dataset.index import Dataset, Entry, assign_splits
from odeform.errors import InputError
from odeform.geometry.shape import surface_weights
from odeform.schema import Parameter, Schema, Window
from odeform.surroundings import Surroundings
from odeform.types import Mesh, MotionSequence

__all__ = ["dataset_from_arrays"]

SPLITS = ("train", "val", "test")


def dataset_from_arrays(
    times: Any,
    vertices: Any,
    parameters: Mapping[str, Any],
    faces: Any,
    *,
    units: Mapping[str, str] | None = None,
    ranges: Mapping[str, tuple[float, float]] | None = None,
    log: Sequence[str] = (),
    weights: Any = None,
    splits: Sequence[str] | None = None,
    fixed: Mapping[str, float] | None = None,
    scene: str = "arrays",
    surroundings: Surroundings | None = None,
    seed: int = 0,
) -> Dataset:
    """Make a data set of S motions of one mesh, which `fit`, `train` and `evaluate` take.

    Args:
        times: (T,) seconds of the frames, evenly spaced from 0.
        vertices: (S, T, N, 3) metres, z up; frame 0 is the body at rest, the same in all motions.
        parameters: by name, (S,) values of each quantity that varies.
        faces: (F, 3) indices of vertices.
        units: of the parameters, by name; default: none.
        ranges: low and high of the parameters, by name; default: the least and the largest value.
        log: names of parameters of which ratios matter, such as masses.
        weights: (N,) mass fraction at each vertex; default: that of the surface.
        splits: "train", "val" or "test" for each motion; default: 70, 10 and 20 % in random order.
        fixed: quantities that are the same in all motions, by name. With `pulse_s`, the seconds that a force drives the
            body, the `rolling` family knows when a push is over.
        scene: name of the scene; that of a bundled one brings its surroundings.
        surroundings: floor, gravity, and the sphere that pushes, if there is one; default: those of the bundled scene
            of that name, else none are known, and no motion is checked against a floor.
        seed: of the random order.

    Raises:
        InputError: Arrays that do not fit together or are not finite, a parameter that does not vary, an unknown split,
            surroundings that are not finite.

    Examples:
        >>> import numpy as np
        >>> import odeform
        >>> body = odeform.load("mass-elastic").rest
        >>> times, speed = np.arange(11) / 10.0, np.linspace(1.0, 2.0, 10)
        >>> path = speed[:, None] * times
        >>> vertices = body.points + path[..., None, None] * np.array([1.0, 0.0, 0.0])
        >>> dataset = odeform.dataset_from_arrays(times, vertices, {"speed": speed}, body.faces, units={"speed": "m/s"})
        >>> len(dataset.select("train")), dataset.schema.parameters[0].high
        (7, 2.0)
    """
    moved, faces = np.asarray(vertices, np.float32), np.asarray(faces, np.int32)
    values = {name: _column(name, column, len(moved)) for name, column in parameters.items()}
    schema = Schema(
        scene,
        _parameters(values, units or {}, ranges or {}, log),
        _window(np.asarray(times, float), moved),
        surroundings=_checked_surroundings(surroundings),
    )
    entries = _entries(schema, moved, values, assign_splits(len(moved), seed) if splits is None else list(splits))
    mass = np.asarray(weights, float) if weights is not None else surface_weights(Mesh(moved[0, 0], faces))

    def read(entry: Entry) -> MotionSequence:
        frames = moved[int(entry.name.removeprefix("motion_"))]
        return checked_sequence(
            MotionSequence(np.asarray(times, float), frames, faces, mass, dict(entry.parameters), entry.name),
            f"vertices, {entry.name}",
        )

    dataset = Dataset(Path("arrays"), schema, entries, read, dict(fixed or {}), {"scene": scene, "made": "of arrays"})
    for entry in entries:
        dataset.read(entry)
    return dataset


def _column(name: str, column: Any, count: int) -> np.ndarray:
    values = np.asarray(column, dtype=float)
    if values.shape != (count,):
        raise InputError(f"parameters: expected {name} of shape ({count},), got {values.shape}")
    return values


def _entries(
    schema: Schema, moved: np.ndarray, values: Mapping[str, np.ndarray], labels: Sequence[str]
) -> tuple[Entry, ...]:
    if len(labels) != len(moved) or not set(labels) <= set(SPLITS):
        raise InputError(
            f"splits: expected {len(moved)} of {', '.join(SPLITS)}, got {len(labels)}: {sorted(set(labels))}"
        )
    return tuple(
        Entry(
            f"motion_{index:04d}",
            label,
            schema.complete({name: float(column[index]) for name, column in values.items()}),
            hashlib.sha256(np.ascontiguousarray(moved[index]).tobytes()).hexdigest(),
        )
        for index, label in enumerate(labels)
    )


def _checked_surroundings(given: Surroundings | None) -> Surroundings | None:
    if given is None:
        return None
    try:
        return Surroundings.from_json(asdict(given))
    except (TypeError, ValueError) as error:
        raise InputError(f"surroundings: {error}") from None


def _parameters(
    values: Mapping[str, np.ndarray],
    units: Mapping[str, str],
    ranges: Mapping[str, tuple[float, float]],
    log: Sequence[str],
) -> tuple[Parameter, ...]:
    for known, what in ((units, "units"), (ranges, "ranges"), (log, "log")):
        if strange := set(known) - set(values):
            raise InputError(f"{what}: unknown parameter {sorted(strange)[0]!r}: expected {', '.join(values)}")
    out = []
    for name, column in values.items():
        low, high = map(float, ranges.get(name, (column.min(), column.max())))
        middle = float(np.clip(np.median(column), low, high))
        out.append(Parameter(name, units.get(name, ""), low, high, middle, "log" if name in log else "linear"))
    return tuple(out)


def _window(times: np.ndarray, moved: np.ndarray) -> Window:
    if moved.ndim != 4 or moved.shape[3] != 3 or moved.shape[1] != len(times) or len(times) < 2:
        raise InputError(f"vertices: expected shape (S, {times.size}, N, 3), got {moved.shape}")
    step = (times[-1] - times[0]) / (len(times) - 1)
    if times[0] != 0.0 or not np.allclose(np.diff(times), step, rtol=1e-4, atol=0.0):
        raise InputError("times: expected seconds that are evenly spaced from 0")
    return Window(0.0, float(times[-1]), float(1.0 / step))
