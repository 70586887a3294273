"""A dog walks: legs swing in diagonal pairs, the body bobs, head and tail follow. Few sequences, no simulation."""

import numpy as np

from odeform.simulation.objects.catalog import get_object
from odeform.types import Faces, Floats, Frames, Points
from odeform_figures.motions.kind import Kind, smoothstep

__all__ = ["KIND"]

HIP = (0.16, 0.06)  # m above the floor: where legs begin to move with the body, and where they are free of it
MIDDLE = 0.03  # m, between fore and hind legs
HEAD, TAIL = 0.2, -0.14  # m along the body


def _turned(points: Points, weights: Floats, angles: Floats, pivot: Floats, axis: int) -> Frames:
    """(T, N, 3): what turning by `weights` (N,) times `angles` (T,) about an axis through `pivot` adds to `points`."""
    angle = angles[:, None] * weights
    one, other = [(axis + 1) % 3, (axis + 2) % 3]
    p, q = points[:, one] - pivot[one], points[:, other] - pivot[other]
    out = np.zeros((len(angles), *points.shape))
    out[..., one] = (np.cos(angle) - 1.0) * p - np.sin(angle) * q
    out[..., other] = (np.cos(angle) - 1.0) * q + np.sin(angle) * p
    return out


def _move(parameters: dict[str, float], times: Floats) -> tuple[Frames, Faces]:
    mesh = get_object("dog").rest_mesh()
    points = mesh.points.astype(float)
    swing, pace = np.radians(parameters["swing"]), parameters["pace"]
    phase = 2.0 * np.pi * pace * times
    legs = 1.0 - smoothstep(points[:, 2], HIP[1], HIP[0])
    fore, left = smoothstep(points[:, 0], MIDDLE - 0.02, MIDDLE + 0.02), smoothstep(points[:, 1], -0.01, 0.01)
    moved = np.broadcast_to(points, (len(times), *points.shape)).copy()
    for is_fore in (True, False):
        for is_left in (True, False):
            side = legs * (fore if is_fore else 1.0 - fore) * (left if is_left else 1.0 - left)
            centre = np.average(points, axis=0, weights=side + 1e-12)
            pivot = np.array([centre[0], centre[1], HIP[0]])
            sign = 1.0 if is_fore == is_left else -1.0
            moved += _turned(points, side, sign * swing * np.sin(phase), pivot, 1)
    head = smoothstep(points[:, 0], HEAD - 0.06, HEAD + 0.04)
    moved += _turned(points, head, 0.3 * swing * (1.0 - np.cos(2.0 * phase)) / 2.0, np.array([HEAD - 0.06, 0, 0.2]), 1)
    tail = smoothstep(-points[:, 0], -TAIL - 0.03, -TAIL + 0.04) * (1.0 - legs)
    moved += _turned(points, tail, 0.8 * swing * np.sin(phase), np.array([TAIL, 0.0, 0.2]), 2)
    # a stiff leg that swings lowers the hip, and a step takes the body as far as its feet reach
    moved[..., 2] -= HIP[0] * (1.0 - np.cos(swing * np.sin(phase)))[:, None]
    moved[..., 0] += 4.0 * HIP[0] * np.sin(swing) * pace * (times**2 / (times + 0.2))[:, None]
    return moved, mesh.faces


KIND = Kind(
    "a walking dog: few sequences, no contact simulated",
    {"swing": "deg", "pace": "Hz"},
    {"swing": (8.0, 32.0), "pace": (0.8, 2.2)},
    sequences=24,
    rate=24.0,
    frames=32,
    move=_move,
)
