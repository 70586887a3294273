"""Measures the motions of a scene for its study, besides the effect of the time step."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from odeform.schema import Parameters, Schema
from odeform.simulation.scenes.registry import get_scene
from odeform.types import MotionSequence

__all__ = [
    "SCENES",
    "Figures",
    "Measurements",
    "contacts",
    "measurements_of",
    "rebound",
]

CONTACT = 2e-3  # m; a vertex lower than this touches the floor
LOW = 1e-2  # m; a lower rebound is a roll, whose relative change means nothing

Figures = dict[str, float | None]
"""Measured values by name, None where one does not apply. Names end in units."""


def whole_motion(sequence: MotionSequence) -> slice:
    """Returns all frames."""
    return slice(0, len(sequence.times))


def _no_figures(coarse: MotionSequence, fine: MotionSequence) -> Figures:
    return {}


@dataclass(frozen=True)
class Measurements:
    """A scene's part in `odeform_figures.studies.study`, which halves the time step of any scene."""

    extremes: tuple[Parameters, ...] = ()
    """Parameter sets at which the simulation is hardest. They are studied first."""
    hidden: tuple[str, ...] = ()
    """Parameters that should be recoverable from a motion; none named: every learned one."""
    frames: Callable[[MotionSequence], slice] = whole_motion
    """The frames in which the hidden parameters have to leave separate marks."""
    figures: Callable[[MotionSequence, MotionSequence], Figures] = _no_figures
    """Figures of a motion, given it at the scene's time step and at half of it."""


def contacts(sequence: MotionSequence) -> list[slice]:
    """Frames during which any vertex touches the floor, one slice a contact."""
    touching = sequence.vertices[..., 2].min(axis=1) < CONTACT
    edges = np.flatnonzero(np.diff(np.concatenate([[False], touching, [False]])))
    return [slice(begin, end) for begin, end in edges.reshape(-1, 2)]


def first_contact(sequence: MotionSequence) -> slice:
    """Frames of the first contact with the floor. Later ones shift in time, which differences do not resolve."""
    return contacts(sequence)[0]


def rebound(sequence: MotionSequence) -> float | None:
    """Metres that the centre of mass rises above its rest position after the first landing; None without one."""
    height = np.einsum("n,tn->t", sequence.weights, sequence.vertices[..., 2].astype(float))
    landing = next((contact.start for contact in contacts(sequence) if contact.start > 0), None)
    return None if landing is None else float(height[landing:].max() - min(height[0], height[-1]))


def bounce_figures(coarse: MotionSequence, fine: MotionSequence) -> Figures:
    """Rebound, its relative change at half the step, depth below the floor and flattening of a bouncing body."""
    before, after = rebound(coarse), rebound(fine)
    change = None if before is None or after is None or after < LOW else abs(before - after) / after
    extent = np.ptp(coarse.vertices[..., 2], axis=1)
    return {
        "rebound_mm": None if before is None else 1e3 * before,
        "rebound_change": change,
        "penetration_mm": float(-1e3 * coarse.vertices[..., 2].min()),
        "flattening": float(1.0 - extent.min() / extent[0]),
    }


def _extremes(schema: Schema) -> tuple[Parameters, ...]:
    """Softest and heaviest, where a ball flattens most; stiffest and lightest, where its contact is hardest. All else,
    such as a force, is at its highest."""
    defaults = schema.complete(None)
    return tuple(
        {**defaults, **{p.name: p.low if p.name == lowest else p.high for p in schema.learned}}
        for lowest in ("bending", "mass")
    )


def _bouncing(name: str, hidden: tuple[str, ...]) -> Measurements:
    return Measurements(_extremes(get_scene(name).schema), hidden, first_contact, bounce_figures)


SCENES: dict[str, Callable[[], Measurements]] = {
    "kick": lambda: _bouncing("kick", ("mass", "bending", "force")),
    "mass-elastic": lambda: _bouncing("mass-elastic", ("mass", "bending")),
}
"""Measurements by name of the scene. In others, a study measures the effect of the time step and of all marks."""


def measurements_of(scene: str) -> Measurements:
    """Return what is measured on a scene of this name, of its own or what is measured on any."""
    return SCENES.get(scene, Measurements)()
