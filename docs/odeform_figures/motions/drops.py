"""Soft balls are dropped and bounce, filmed at 20 Hz: contacts between frames (`odeform simulate mass-elastic`)."""

import numpy as np

from odeform.simulation.scenes.mass_elastic import SCHEMA, simulate
from odeform.types import Faces, Floats, Frames
from odeform_figures.motions.kind import Kind

__all__ = ["KIND"]


def _move(parameters: dict[str, float], times: Floats) -> tuple[Frames, Faces]:
    rate = 1.0 / (times[1] - times[0])
    found = simulate(parameters, rate).frames(float(times[-1]), rate)
    return np.asarray(found.vertices, dtype=float), found.faces


KIND = Kind(
    "soft balls that drop and bounce, at 20 Hz",
    {p.name: p.unit for p in SCHEMA.parameters},
    {p.name: (p.low, p.high) for p in SCHEMA.parameters},
    sequences=60,
    rate=20.0,
    frames=21,
    move=_move,
)
