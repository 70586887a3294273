"""Trains the rolling model of a round body: where the push leaves it, its contact parameters, how it is deformed, and
how wrong it is beyond the window."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import Float

from odeform.checkpoint import Checkpoint
from odeform.dataset.training_data import TrainingData
from odeform.errors import InputError
from odeform.mechanics.floor import GRAVITY
from odeform.mechanics.rolling.contact import ADJUSTED, COEFFICIENTS, RollingContact, initial_contact
from odeform.mechanics.rolling.dynamics import CLEAR, MOVING, STATE
from odeform.mechanics.rolling.support import Support, support_of
from odeform.models.continuation import LATER_ERRORS
from odeform.models.kernels.regression import KernelRegression
from odeform.models.kernels.ridge import search_ridge
from odeform.models.rolling.model import UNTURNED, RollingModel
from odeform.models.rolling.readout import inputs_of
from odeform.models.rolling.start import PUSHES, push_inputs, start_arrays
from odeform.models.rolling.training.contact_fit import ROBUST, STEP, Motions, contact_error_mm, fit_contact, roll_out
from odeform.models.rolling.training.readout_fit import ReadoutRows, fit_readout
from odeform.models.training.continuation import HELD_OUT
from odeform.models.training.part import read_part, write_part
from odeform.models.training.pruning import LARGE
from odeform.models.training.qualities import Validation, with_qualities
from odeform.models.training.request import TrainRequest
from odeform.models.training.residual_fit import with_residual
from odeform.models.training.run import Run
from odeform.motion.body import checked_body
from odeform.motion.reduced_space import POSE, small_motion
from odeform.schema import REACH
from odeform.solver.integrate import SolverSettings
from odeform.types import Arrays, Floats, Ints, PointCloud

__all__ = ["fit_rolling_body", "later_errors", "motions_of", "train_rolling"]


@dataclass(frozen=True)
class Stage:
    """Describes a part of the fit of contact parameters."""

    steps: int
    frames: float = 1.0
    """Fraction of the frames from the first landing on."""
    linear: bool = False
    """Whether they are linear in the material, without the network."""
    robust: float = ROBUST
    """mm."""
    step: float = STEP
    """s."""
    damping: float = 1e-2
    """Damping of the first step; see `fit_contact`."""


COARSE = 50.0  # mm
FINE = 3.5e-4  # s: at the speed of a fall, floor and wall are stiff
PUSHED = (Stage(8, linear=True), Stage(32))
FALLING = (
    Stage(8, 0.0, linear=True, robust=COARSE, damping=1.0),
    Stage(8, 0.0, robust=COARSE),
    Stage(10, 0.0),
    Stage(6, 0.56, robust=COARSE),
    Stage(8, robust=COARSE),
    Stage(20, step=FINE),
)
"""The first landings come first: what is wrong about one, the next amplify until nothing can be learned from them."""

BUDGET = 0.7  # of the time, for contact parameters
SMALL = 0.2  # how much deformations that are not large count in the training of the network
LEVEL = 1e-3  # height that a unit axis may have
ROUND = 0.02  # by which points may be nearer to the axis than others, relative
CORNERS, UNFELT = list(COEFFICIENTS).index("corners"), -6.0  # the coefficient, and a value at which it does nothing
STILL = 0.1  # of the radius by which points of a body that moves only up and down may be beside its line
FALLEN = 0.9  # of the time to the first landing, for which the fall is checked
WITH_KINKS = SolverSettings("dopri5", tolerance=1e-8, dtype="float64")  # finer ones take thousands of steps at contacts
WHOLE, RINGING = 2, 12  # frames after a push, up to which the residual is whole, and fades
RATES = 0.3  # s: errors of rates count as they are after this time


def train_rolling(run: Run) -> Checkpoint:
    """Train on the data of `run`: contact parameters, readout, residual and solver settings, in this order."""
    data = run.reduced_data(patterns=True)
    checkpoint = run.reduced_checkpoint(data, *fit_rolling_body(data, run.request, run.report, run.part))
    schema = replace(checkpoint.schema, window=replace(checkpoint.schema.window, reach=REACH))
    checkpoint = replace(checkpoint, schema=schema)
    if "residual" not in run.request.without:
        free = data.first_free
        fading = (free + WHOLE, min(free + RINGING, len(data.times) - 1)) if free else None
        checkpoint = with_residual(checkpoint, data, fading)
    checkpoint = with_qualities(checkpoint, Validation.of(data), WITH_KINKS)
    if (later := later_errors(RollingModel(checkpoint), data)) is None:
        return checkpoint
    return replace(checkpoint, arrays={**checkpoint.arrays, LATER_ERRORS: later.astype(np.float32)})


def fit_rolling_body(
    data: TrainingData, request: TrainRequest, report: Callable[[str], None], part: Path | None = None
) -> tuple[Arrays, dict[str, Any]]:
    """Fits the arrays and settings of the checkpoint, without the residual.

    Contact parameters are kept in `part` after each stage; a resumed training continues after the last one.

    `InputError` for data of a body that is not round, or neither rolls about one horizontal axis nor moves only up and
    down, and where frames of a push are left out.
    """
    axis, radius = _checked(data)
    # what does not turn stands on one corner
    without = request.without if data.space.rolling else (*request.without, "corners")
    support = support_of(data.rest, axis)
    materials = [i for i, p in enumerate(data.schema.learned) if p.name not in PUSHES]
    if not materials:
        raise InputError(f"rolling: expected a parameter besides {' and '.join(PUSHES)}")
    motions = {split: motions_of(data, split, axis, materials) for split in ("train", "val")}
    start = _start(data, motions)

    def go_on() -> bool:
        return request.steps is not None or time.process_time() - begin < 60.0 * BUDGET * request.minutes

    stages = FALLING if data.space.rolling is None else PUSHED
    counts = _steps(stages, request.steps)
    contact = _without(initial_contact(len(materials), request.seed), without)
    training = {"data": data.identity, "seed": request.seed, "without": list(without), "steps": counts}
    known: dict[str, Any] = {"stages": 0, "seconds": 0.0}
    if request.resume and part is not None:
        known = read_part(part, training)
        contact = contact.like(known["numbers"].numpy())
        report(f"continues after {known['seconds'] / 60.0:.1f} min, with stage {known['stages'] + 1}")
    begin = time.process_time() - known["seconds"]
    for index, (stage, steps) in enumerate(zip(stages, counts, strict=True)):
        motions = {split: replace(of, step=stage.step) for split, of in motions.items()}
        if index < known["stages"]:
            continue
        some, free = motions["train"].landings(stage.frames), _free(contact, without, stage.linear)
        contact = fit_contact(contact, free, support, radius, some, steps, report, go_on, stage.robust, stage.damping)
        if part is not None:
            state = {"stages": index + 1, "numbers": torch.from_numpy(contact.flat())}
            write_part(part, training, {**state, "seconds": time.process_time() - begin})
    error = contact_error_mm(contact, support, radius, motions["val"])
    report(f"contact parameters alone: pose RMSE {error:.2f} mm (val)")
    fraction = min(sum(counts) / sum(stage.steps for stage in stages), 1.0)
    readout = fit_readout(_rows(data, contact, support, radius, motions["train"]), request.seed, fraction)
    names = [data.schema.learned[i].name for i in materials]
    val = {"law_rmse_mm": error, "seconds": time.process_time() - begin}
    settings = {"material": names, "begin_s": _begin(data), "clearance_m": _clearance(data), "radius_m": radius}
    settings |= {"lowest_m": _lowest(data), "val": val, "qualities": {}}
    return {**contact.arrays(), **start_arrays(start), **readout.arrays()}, settings


def _steps(stages: Sequence[Stage], total: int | None) -> list[int]:
    """Splits the steps over the stages: in the same proportions where they are `total` together, the first ones
    first."""
    ends = np.cumsum([stage.steps for stage in stages])
    ends = ends if total is None else np.ceil(total * ends / ends[-1] - 1e-9).astype(int)
    return np.diff(ends, prepend=0).tolist()


def _checked(data: TrainingData) -> tuple[Floats, float]:
    """The axis and the radius of the body."""
    rolling, distances = data.space.rolling, np.linalg.norm(data.rest, axis=1)
    radius = float(distances.mean())
    if rolling is not None and abs(rolling.axis[2]) > LEVEL:
        raise InputError("rolling: expected motions of a body that rolls about one horizontal axis")
    if rolling is None and not _falls_straight(data, radius):
        raise InputError("rolling: expected a body that rolls about one horizontal axis, or falls straight from rest")
    if distances.min() < (1.0 - ROUND) * distances.max():
        raise InputError("rolling: expected a round body, about its mass centre")
    if rolling is not None and not _is_observed(data):
        raise InputError("rolling: expected no --every or --stagger where a push is to be observed")
    if rolling is not None and not 0 < data.first_free < len(data.times) - 3:
        raise InputError("rolling: expected motions that begin with a push, and go on after it")
    return UNTURNED if rolling is None else rolling.axis, radius


def _falls_straight(data: TrainingData, radius: float) -> bool:
    """Whether no point of the body leaves its line by much, and it falls from rest as what is dropped does."""
    poses, clearance = data.reduced["train"][..., :POSE], _clearance(data)
    aside = np.abs(np.concatenate([poses[..., :2], radius * poses[..., 3:]], axis=-1)).max()
    early = data.times < FALLEN * np.sqrt(2.0 * clearance / GRAVITY)
    off = np.abs(poses[..., 2] + 0.5 * GRAVITY * data.times**2)[:, early]
    seen = data.observed["train"][:, early]
    return clearance > 0.0 and data.first_free == 0 and aside < STILL * radius and bool((off[seen] < CLEAR).all())


def _is_observed(data: TrainingData) -> bool:
    return all(observed.all() for observed in data.observed.values())


def _clearance(data: TrainingData) -> float:
    """m of the lowest point at rest above the floor, zero for a body that lies on it."""
    lowest = float(data.rest[:, 2].min() + data.space.anchor[2])
    return lowest if lowest > CLEAR else 0.0


def _lowest(data: TrainingData) -> float:
    """m: the height of the lowest point in all frames of the training motions."""
    space = data.space
    body = checked_body(PointCloud(data.rest + space.anchor), space, float("-inf"))
    known = (space.with_modes(motion) for motion in data.reduced["train"])
    return min(float(body.sample(y, np.ones(len(y))).lowest.min()) for y in known)


def _begin(data: TrainingData) -> float:
    """s: half a frame after the first free frame, where differences of frames give the velocity."""
    return float(data.times[data.first_free] + data.times[data.first_free + 1]) / 2.0


def motions_of(data: TrainingData, split: str, axis: Floats, materials: list[int]) -> Motions:
    """Takes the motions of a split, of a body that turns about `axis` (3,); `materials` are the indices of its Q
    parameters."""
    y, first = data.reduced[split], data.first_free
    frame = float(data.times[1] - data.times[0])
    along = np.cross(axis, [0.0, 0.0, 1.0])
    moved = np.stack([y[..., :3] @ along, y[..., 2] + _clearance(data), y[..., 3:POSE] @ axis], axis=-1)
    start = np.zeros((STATE, len(y)))
    if data.space.rolling is None:  # falls from rest
        moved[..., [0, 2]] = 0.0
        start[1], start[MOVING + 1] = _clearance(data) - GRAVITY * frame**2 / 8.0, -GRAVITY * frame / 2.0
    else:
        before, after = moved[:, first], moved[:, first + 1]
        start[:MOVING], start[MOVING : 2 * MOVING] = 0.5 * (before + after).T, (after - before).T / frame
        start[1] += GRAVITY * frame**2 / 8.0  # between the two, a body that flies is higher than their mean
    later, seen = moved[:, first + 1 :].transpose(1, 0, 2), data.observed[split][:, first + 1 :].T
    return Motions(data.theta[split][:, materials], start, later, seen, frame)


def _start(data: TrainingData, motions: dict[str, Motions]) -> KernelRegression:
    known, asked = (push_inputs(data.schema, data.theta[split]) for split in ("train", "val"))
    scale = np.repeat([1.0, RATES], MOVING) * np.tile([1.0, 1.0, data.space.gyration_radius], 2)
    states = {split: of.start[: 2 * MOVING].T for split, of in motions.items()}
    linear = np.linalg.lstsq(_with_one(known), states["train"], rcond=None)[0]
    rest = scale * (states["train"] - _with_one(known) @ linear)
    ridge = search_ridge(known, rest, (asked, scale * (states["val"] - _with_one(asked) @ linear)))[0]
    regression = ridge.fit(known, rest)
    return replace(regression, weights=regression.weights / scale, trend=linear)


def _with_one(inputs: Floats) -> Float[np.ndarray, "motions rows"]:
    return np.concatenate([np.ones((len(inputs), 1)), inputs], axis=1)


def _without(contact: RollingContact, parts: Sequence[str]) -> RollingContact:
    """Makes the contact from which a fit without some of its `parts` starts: without corners, they are hardly felt."""
    terms, last = contact.terms.copy(), contact.last.copy()
    if "corners" in parts:
        terms[CORNERS, 0] = UNFELT
        last[:, ADJUSTED.index("corners")] = 0.0
    if "network" in parts:
        last[:] = 0.0
    return replace(contact, terms=terms, last=last)


def _free(contact: RollingContact, without: Sequence[str], linear: bool) -> Ints:
    """Indices of the numbers that are fitted, of all but the parts that are left out. With `linear`, only of those that
    are constant or linear in the material, without the network and the place of rest."""
    flags = {field.name: np.ones_like(getattr(contact, field.name)) for field in fields(contact)}
    if linear:
        flags["terms"][:, contact.settled.shape[-1] :] = 0.0
    if "corners" in without:
        flags["terms"][CORNERS] = 0.0
        flags["last"][:, ADJUSTED.index("corners")] = 0.0
    empty = {"settled"} if linear or "corners" in without else set()
    empty |= {"first", "bias", "last"} if linear or "network" in without else set()
    for name in empty:
        flags[name][:] = 0.0
    return np.flatnonzero(RollingContact(**flags).flat())


def _rows(
    data: TrainingData, contact: RollingContact, support: Support, radius: float, motions: Motions
) -> ReadoutRows:
    """Rolls out motions under the fitted contact, so that what is read out of them knows what it is wrong about."""
    states = roll_out(contact, support, radius, motions)
    count = len(states)
    flat = states.transpose(1, 2, 0).reshape(STATE, -1)
    material = np.repeat(motions.material, count, axis=0)
    heights = np.repeat(1e-3 * contact.coefficients(motions.material)["height"], count)
    patterns = data.reduced["train"][..., POSE:]
    sizes = np.linalg.norm(patterns, axis=2)
    large = sizes > LARGE * sizes.max(axis=1, keepdims=True)
    weights, seen = np.where(large[:, -count:], 1.0, SMALL).ravel(), motions.seen.T.ravel()
    inputs, patterns = inputs_of(flat, heights, material), patterns[:, -count:].reshape(len(weights), -1)
    return ReadoutRows(inputs[seen], patterns[seen], weights[seen])


def later_errors(model: RollingModel, data: TrainingData) -> Floats | None:
    """(S, L) RMSE in mm of validation motions over the last third of the window, where the motion of the ODE goes on
    from the corrected one, as it does beyond the window. None where a spline filled in frames."""
    if not _is_observed(data):
        return None
    evaluated, times = model.evaluate_basis(model.rest, 0.0), data.times
    kept, stop = round((1.0 - HELD_OUT) * len(times)), float(times[-1])
    quality, missed = model.qualities["reference"], []
    for theta, truth in zip(data.theta["val"], data.reduced["val"], strict=True):
        corrected = model.trajectory(theta, evaluated, quality, stop).reduced(times[kept - 1 : kept])
        own = model.integrate(theta, evaluated, quality, stop).reduced(times[kept - 1 :])
        missed.append(corrected + own[1:] - own[:1] - truth[kept:])
    return 1e3 * small_motion(np.stack(missed), data.space.gyration_radius) / np.sqrt(3.0)
