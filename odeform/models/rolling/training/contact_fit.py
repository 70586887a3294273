"""Fits contact parameters to motions of a rolling body: Gauss-Newton on whole roll-outs, with exact derivatives."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from odeform.mechanics.rolling.contact import RollingContact
from odeform.mechanics.rolling.dynamics import CLEAR, MOVING, RollingDynamics
from odeform.mechanics.rolling.sensitivities import roll_out_with_sensitivities
from odeform.mechanics.rolling.support import Support
from odeform.types import Bools, Floats, Ints

__all__ = ["ROBUST", "Motions", "contact_error_mm", "fit_contact", "roll_out"]

STEP = 1.05e-3  # s
HEIGHTS = 2.5  # times what other errors count: they decide when a landing comes, and how deep it is
ROBUST = 5.0
"""mm: larger errors count by their logarithm, so that a ball that stops on the wrong facet decides nothing."""
EVERY, FEW = 3, 90  # frames: of more than a few, only some are compared
STEEP = 300.0  # largest derivative that is believed
TOGETHER = 128  # motions whose derivatives are computed at once
LANDING = 0.217  # s that a landing takes at most
PRIOR = 1e-4  # towards the parameters that a fit starts from
TRIES = 7  # of a step, each more cautious
ENOUGH = 5e-4  # relative gain of a step, below which the fit ends


@dataclass(frozen=True, eq=False)
class Motions:
    """Motions of M bodies from the end of the push, or from half a frame of their fall, on."""

    material: Float[np.ndarray, "motions materials"]
    start: Float[np.ndarray, "states motions"]
    """(8, M) states there."""
    moved: Float[np.ndarray, "frames motions 3"]
    """Ahead, height (m) and angle (rad) in the frames after it: half a frame later, and every frame from there on."""
    seen: Bools
    """(T, M) whether a frame is of the data."""
    frame: float
    """s."""
    step: float = STEP
    """s that a step of their integration takes at most."""

    def some(self, rows: Ints) -> "Motions":
        """Selects the motions with the indices `rows` (R,) only."""
        material, start = self.material[rows], self.start[:, rows]
        return replace(self, material=material, start=start, moved=self.moved[:, rows], seen=self.seen[:, rows])

    @property
    def every(self) -> int:
        """How many frames on the next one is compared: where there are few, or some are not of the data, all."""
        return EVERY if self.seen.all() and len(self.moved) > FEW else 1

    def landings(self, fraction: float) -> "Motions":
        """Keeps that fraction of the frames from the first landing on, at least to the end of that landing."""
        landed = int((self.moved[..., 1] < CLEAR).any(axis=1).argmax())
        count = landed + max(round(fraction * (len(self.moved) - landed)), round(LANDING / self.frame))
        return replace(self, moved=self.moved[:count], seen=self.seen[:count])


def roll_out(contact: RollingContact, support: Support, radius: float, motions: Motions) -> Floats:
    """Computes (T, 8, M) states in the frames of `motions`."""
    dynamics = RollingDynamics(contact, support, radius, motions.material)
    return dynamics.roll_out(motions.start, *_half_frames(motions))[1::2]


def _half_frames(motions: Motions) -> tuple[int, int, float]:
    """Steps in half a frame, half frames, and the seconds of a step."""
    half = max(round(0.5 * motions.frame / motions.step + 0.499), 1)
    return half, 2 * len(motions.moved) - 1, 0.5 * motions.frame / half


def _missed(states: Floats, motions: Motions, radius: float, robust: float) -> tuple[Floats, Floats]:
    """Robust errors of states (T, 8, M) in the compared frames, in units of `robust` mm, and their derivatives by the
    position: (E, M, 3) each, zero where a frame is not of the data."""
    seen = motions.seen[:: motions.every, :, None]
    scale = seen * 1e3 / robust * np.array([1.0, HEIGHTS, radius * np.sqrt(2.0 / 3.0)])
    apart = states[:: motions.every, :MOVING].swapaxes(1, 2) - motions.moved[:: motions.every]
    apart = np.nan_to_num(scale * apart, nan=200.0, posinf=200.0, neginf=-200.0)
    return np.arcsinh(apart), scale / np.sqrt(1.0 + apart**2)


def contact_error_mm(contact: RollingContact, support: Support, radius: float, motions: Motions) -> float:
    """Returns the pooled RMSE of the pose in mm, over the frames (T,) of the data and the motions (M,)."""
    states = roll_out(contact, support, radius, motions)[:, :MOVING]
    apart = (states.swapaxes(1, 2) - motions.moved) * np.array([1.0, 1.0, radius * np.sqrt(2.0 / 3.0)])
    return float(1e3 * np.sqrt(np.square(apart)[motions.seen].mean()))


@dataclass
class _Normal:
    """Collects the errors at one set of coefficients: their mean square, and with their Jacobian J of E rows, J^T J / E
    and J^T errors / E."""

    cost: float
    square: Float[np.ndarray, "free free"]
    slope: Float[np.ndarray, " free"]


def _normal(
    contact: RollingContact, free: Ints, support: Support, radius: float, motions: Motions, robust: float
) -> _Normal:
    total = _Normal(0.0, np.zeros((len(free), len(free))), np.zeros(len(free)))
    count, weight = len(motions.material), 1.0 / (MOVING * motions.seen[:: motions.every].sum())
    for at in range(0, count, TOGETHER):
        some = motions.some(np.arange(at, min(at + TOGETHER, count)))
        dynamics, (half, frames, step) = RollingDynamics(contact, support, radius, some.material), _half_frames(motions)
        states, changes = roll_out_with_sensitivities(dynamics, free, some.start, half, frames, step)
        errors, by_position = _missed(states[1::2], some, radius, robust)
        jacobian = by_position[..., None].astype(np.float32) * changes[1::2][:: some.every]
        jacobian = np.clip(np.nan_to_num(jacobian), -STEEP, STEEP).reshape(-1, len(free))
        total.cost += weight * float(np.square(errors).sum())
        total.square += weight * (jacobian.T @ jacobian)
        total.slope += weight * (jacobian.T @ errors.ravel())
    return total


def fit_contact(
    contact: RollingContact,
    free: Ints,
    support: Support,
    radius: float,
    motions: Motions,
    steps: int,
    report: Callable[[str], None],
    go_on: Callable[[], bool] = lambda: True,
    robust: float = ROBUST,
    damping: float = 1e-2,
) -> RollingContact:
    """Takes at most `steps` steps of Levenberg and Marquardt from `contact`, in which the numbers with the indices
    `free` (F,) change; `radius` is in m, and errors count in full up to about `robust` mm.
    `damping` is that of the first step: 1 where they are far off, and their derivatives tell little.

    It ends earlier where a step gains hardly anything, and when `go_on` says so.
    """

    def cost_of(trial: RollingContact) -> float:
        states = roll_out(trial, support, radius, motions)
        missed = _missed(states, motions, radius, robust)[0]
        return float(np.square(missed).sum() / (MOVING * motions.seen[:: motions.every].sum()))

    now, first = contact, contact.flat()[free]
    for step in range(steps):
        if not go_on():
            break
        known, numbers = _normal(now, free, support, radius, motions, robust), now.flat()
        normal = known.square + PRIOR * np.eye(len(free))
        slope = known.slope + PRIOR * (numbers[free] - first)
        for _ in range(TRIES):
            change = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), -slope)
            trial = numbers.copy()
            trial[free] += np.clip(change, -1.0, 1.0)
            cost = cost_of(contact.like(trial))
            if cost < known.cost:
                break
            damping *= 6.0
        else:
            break
        now, damping = contact.like(trial), max(damping / 4.0, 1e-6)
        report(f"contact parameters, step {step + 1}: robust pose error {robust * np.sqrt(cost):.2f} mm (train)")
        if known.cost - cost < ENOUGH * known.cost:
            break
    return now
