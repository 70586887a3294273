"""A bottle that stands fast is struck and rings: deformation alone, of five modes that stiffen with amplitude."""

import numpy as np

from odeform.simulation.objects.catalog import get_object
from odeform.types import Faces, Floats, Frames, Points
from odeform_figures.motions.kind import Kind

__all__ = ["KIND"]

HERTZ = np.array([2.0, 2.3, 5.2, 7.0, 9.0])  # of each mode at stiffness 1
AMPLITUDES = np.array([1.0, 0.5, 0.35, 0.3, 0.2])  # of the amplitude
DAMPING = 0.06  # of the critical
STIFFENING = 40.0  # 1/m^2: relative frequency per squared amplitude


def _modes(points: Points) -> Floats:
    """(5, N, 3) shapes, at most one long: two of bending, one of second order, twist and breathing."""
    height = points[:, 2] / points[:, 2].max()
    low, mid = height**2 * (3.0 - height) / 2.0, 4.0 * height**2 * (0.8 - height)
    radial = points * [1.0, 1.0, 0.0] / np.abs(points[:, :2]).max()
    around = np.stack([-radial[:, 1], radial[:, 0], np.zeros(len(points))], axis=1)
    x, y = np.eye(3)[:2]
    return np.stack(
        [low[:, None] * x, low[:, None] * y, mid[:, None] * x, height[:, None] * around, mid[:, None] * radial]
    )


def _move(parameters: dict[str, float], times: Floats) -> tuple[Frames, Faces]:
    mesh = get_object("bottle").rest_mesh()
    points = mesh.points.astype(float)
    size = 1e-3 * parameters["amplitude"]
    slow = 2.0 * np.pi * HERTZ * np.sqrt(parameters["stiffness"])
    decay = np.exp(-DAMPING * np.outer(times, slow))
    # the phase of an oscillation whose frequency falls with its decaying square
    phase = np.outer(times, slow) + STIFFENING * size**2 * (1.0 - decay**2) / (2.0 * DAMPING)
    moved = np.einsum("tm,mni->tni", size * AMPLITUDES * decay * np.sin(phase), _modes(points))
    return points + moved, mesh.faces


KIND = Kind(
    "a bottle that rings: deformation alone",
    {"stiffness": "", "amplitude": "mm"},
    {"stiffness": (0.5, 2.0), "amplitude": (5.0, 40.0)},
    sequences=40,
    rate=40.0,
    frames=41,
    move=_move,
)
