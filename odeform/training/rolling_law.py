"""Fits a law of contact to motions of a rolling body: Gauss-Newton on whole roll-outs.

A law has some two hundred numbers. Roll-outs of all its changes together cost little more than one of them, so that
differences give the Jacobian, and few steps are needed.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from odeform.mechanics.rolling.dynamics import MOVING, RollingDynamics
from odeform.mechanics.rolling.law import RollingLaw
from odeform.mechanics.rolling.support import Support
from odeform.types import Floats, Ints

__all__ = ["Motions", "fit_law", "law_error_mm"]

STEP = 1.05e-3  # s, at most
ROBUST = 5.0  # mm; larger errors count by their logarithm: a ball that stops on the wrong facet decides nothing
EVERY = 3  # frames that are compared
CHANGED = 1e-4  # of a number, for differences
STEEP = 300.0  # largest derivative that is believed
TOGETHER = 24  # laws that are rolled out at once
PRIOR = 1e-4  # towards the law that a fit starts from
TRIES = 7  # of a step, each more cautious
ENOUGH = 5e-4  # relative gain of a step, below which the fit ends


@dataclass(frozen=True, eq=False)
class Motions:
    """Motions of M bodies from the end of the push on."""

    material: Float[np.ndarray, "motions materials"]
    start: Float[np.ndarray, "states motions"]
    """(8, M) states at the end of the push."""
    moved: Float[np.ndarray, "frames motions 3"]
    """Ahead, height (m) and angle (rad) in the frames after it: half a frame later, and every frame from there on."""
    frame: float
    """s."""

    def some(self, rows: Ints) -> "Motions":
        """Of the motions with the indices `rows` (R,) only."""
        return replace(self, material=self.material[rows], start=self.start[:, rows], moved=self.moved[:, rows])


def roll_out(law: RollingLaw, support: Support, radius: float, motions: Motions) -> Floats:
    """(T, 8, B, M) states in the frames of `motions`, under laws with one leading axis (B)."""
    dynamics = RollingDynamics(law, support, radius, motions.material)
    half = max(round(0.5 * motions.frame / STEP + 0.499), 1)
    states = dynamics.roll_out(motions.start, half, 2 * len(motions.moved) - 1, 0.5 * motions.frame / half)
    return states[1::2]


def _missed(states: Floats, motions: Motions, radius: float) -> Float[np.ndarray, "laws errors"]:
    """Robust errors of states (T, 8, B, M), in units of `ROBUST`, flat."""
    scale = 1e3 / ROBUST * np.array([1.0, 1.0, radius * np.sqrt(2.0 / 3.0)])
    apart = states[::EVERY, :MOVING].transpose(2, 0, 3, 1) - motions.moved[::EVERY]
    apart = np.nan_to_num(scale * apart, nan=200.0, posinf=200.0, neginf=-200.0)
    return np.arcsinh(apart).reshape(len(apart), -1)


def law_error_mm(law: RollingLaw, support: Support, radius: float, motions: Motions) -> float:
    """Pooled RMSE of the pose in mm, over the frames (T,) and the motions (M,)."""
    states = roll_out(law.like(law.flat()[None]), support, radius, motions)[:, :MOVING, 0]
    apart = (states.transpose(0, 2, 1) - motions.moved) * np.array([1.0, 1.0, radius * np.sqrt(2.0 / 3.0)])
    return float(1e3 * np.sqrt(np.square(apart).sum(axis=2).mean() / 3.0))


def fit_law(
    law: RollingLaw,
    free: Ints,
    support: Support,
    radius: float,
    motions: Motions,
    steps: int,
    report: Callable[[str], None],
    go_on: Callable[[], bool] = lambda: True,
) -> RollingLaw:
    """The law after at most `steps` steps of Levenberg and Marquardt, in which the numbers with the indices
    `free` (F,) change; `radius` is in m.

    It ends earlier where a step gains hardly anything, and when `go_on` says so.
    """

    def missed(flat: Floats) -> Floats:
        return _missed(roll_out(law.like(flat), support, radius, motions), motions, radius)

    now = law.flat()
    first, damping, errors = now[free], 1e-2, missed(now[None])[0]
    cost = errors @ errors / len(errors)
    for step in range(steps):
        if not go_on():
            break
        jacobian = np.empty((len(errors), len(free)), dtype=np.float32)
        for at in range(0, len(free), TOGETHER):
            some = free[at : at + TOGETHER]
            changed = np.tile(now, (len(some), 1))
            changed[np.arange(len(some)), some] += CHANGED
            jacobian[:, at : at + TOGETHER] = ((missed(changed) - errors) / CHANGED).T
        jacobian = np.clip(jacobian, -STEEP, STEEP)
        normal = (jacobian.T @ jacobian).astype(float) / len(errors) + PRIOR * np.eye(len(free))
        slope = (jacobian.T @ errors) / len(errors) + PRIOR * (now[free] - first)
        for _ in range(TRIES):
            change = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), -slope)
            trial = now.copy()
            trial[free] += np.clip(change, -1.0, 1.0)
            trial_errors = missed(trial[None])[0]
            trial_cost = trial_errors @ trial_errors / len(errors)
            if trial_cost < cost:
                break
            damping *= 6.0
        else:
            break
        gained, damping = cost - trial_cost, max(damping / 4.0, 1e-6)
        now, errors, cost = trial, trial_errors, trial_cost
        report(f"contact law, step {step + 1}: robust pose error {ROBUST * np.sqrt(cost):.2f} mm (train)")
        if gained < ENOUGH * cost:
            break
    return law.like(now)
