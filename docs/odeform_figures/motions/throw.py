"""A bottle is thrown and tumbles: rigid motion alone, on a parabola and by Euler's equations without torque."""

import numpy as np
from scipy.integrate import solve_ivp

from odeform.simulation.objects.catalog import get_object
from odeform.simulation.physics import GRAVITY
from odeform.types import Faces, Floats, Frames
from odeform_figures.motions.kind import Kind

__all__ = ["KIND"]

AXIS = np.array([0.2, 0.9, 0.4])  # of the initial spin: no principal axis, so that it wobbles


def _orientations(inertia: Floats, spin: Floats, times: Floats) -> Floats:
    """(T, 3, 3) rotations of a free body with principal moments `inertia` (3,) and initial `spin` (3,) in rad/s."""

    def slope(_: float, state: Floats) -> Floats:
        rates, turned = state[:3], state[3:].reshape(3, 3)
        x, y, z = rates
        matrix = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        return np.concatenate([np.cross(inertia * rates, rates) / inertia, (turned @ matrix).ravel()])

    start = np.concatenate([spin, np.eye(3).ravel()])
    found = solve_ivp(slope, (0.0, times[-1]), start, t_eval=times, rtol=1e-10, atol=1e-12)
    u, _, vt = np.linalg.svd(found.y[3:].T.reshape(-1, 3, 3))  # orthogonal to the last digit
    return u @ vt


def _move(parameters: dict[str, float], times: Floats) -> tuple[Frames, Faces]:
    body = get_object("bottle")
    mesh, weights = body.rest_mesh(), body.weights
    points = mesh.points.astype(float)
    centre = weights @ points
    centred = points - centre
    tensor = np.einsum("n,ni,nj->ij", weights, centred, centred)
    moments, axes = np.linalg.eigh(np.trace(tensor) * np.eye(3) - tensor)
    axes[:, 2] *= np.linalg.det(axes)
    spin = parameters["spin"] * AXIS / np.linalg.norm(AXIS)
    turned = axes @ _orientations(moments, axes.T @ spin, times) @ axes.T
    angle = np.radians(parameters["elevation"])
    velocity = parameters["speed"] * np.array([np.cos(angle), 0.0, np.sin(angle)])
    shift = times[:, None] * velocity - 0.5 * GRAVITY * times[:, None] ** 2 * np.array([0.0, 0.0, 1.0])
    return np.einsum("tij,nj->tni", turned, centred) + centre + shift[:, None], mesh.faces


KIND = Kind(
    "a thrown bottle: rigid motion alone",
    {"speed": "m/s", "elevation": "deg", "spin": "rad/s"},
    {"speed": (6.5, 9.0), "elevation": (50.0, 75.0), "spin": (2.0, 9.0)},
    sequences=60,
    rate=30.0,
    frames=31,
    move=_move,
)
