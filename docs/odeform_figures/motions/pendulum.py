"""A soft rope of two links hangs, is pushed and swings: a nonlinear ODE, bent smoothly at its joint."""

import numpy as np
from scipy.integrate import solve_ivp

from odeform.simulation.physics import GRAVITY
from odeform.types import Faces, Floats, Frames
from odeform_figures.motions.kind import Kind, smoothstep

__all__ = ["KIND"]

LENGTH, RADIUS = 0.5, 0.02  # m
RINGS, AROUND = 60, 14
SOFT = 0.12  # m of the rope around the joint that bends


def _tube() -> tuple[Floats, Floats, Faces]:
    """Position along the rope (N,), places across it (N, 2) and faces of a closed tube."""
    along, angle = np.linspace(0.0, LENGTH, RINGS), 2.0 * np.pi * np.arange(AROUND) / AROUND
    circle = RADIUS * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    s, across = np.repeat(along, AROUND), np.tile(circle, (RINGS, 1))
    ring, step = np.arange(RINGS - 1)[:, None] * AROUND, np.arange(AROUND)
    a, b = ring + step, ring + (step + 1) % AROUND
    c, d = a + AROUND, b + AROUND
    sides = np.concatenate([np.stack([a, c, b], -1).reshape(-1, 3), np.stack([b, c, d], -1).reshape(-1, 3)])
    top, bottom, last = len(s), len(s) + 1, (RINGS - 1) * AROUND
    caps = [(top, i, (i + 1) % AROUND) for i in range(AROUND)]
    caps += [(bottom, last + (i + 1) % AROUND, last + i) for i in range(AROUND)]
    faces = np.concatenate([sides, np.array(caps)]).astype(np.int32)
    return np.append(s, [0.0, LENGTH]), np.concatenate([across, np.zeros((2, 2))]), faces


def _angles(parameters: dict[str, float], times: Floats) -> Floats:
    """(T, 2) angles of both links from the vertical: a damped double pendulum of equal masses."""
    first = parameters["joint"] * LENGTH
    second, damping = LENGTH - first, parameters["damping"]

    def slope(_: float, state: Floats) -> Floats:
        a, b, da, db = state
        mass = np.array([[2.0 * first, second * np.cos(a - b)], [first * np.cos(a - b), second]])
        force = np.array(
            [
                -second * db**2 * np.sin(a - b) - 2.0 * GRAVITY * np.sin(a) - damping * first * da,
                first * da**2 * np.sin(a - b) - GRAVITY * np.sin(b) - damping * second * (db - da),
            ]
        )
        return np.concatenate([[da, db], np.linalg.solve(mass, force)])

    start = [0.0, 0.0, parameters["push"], parameters["push"]]
    return solve_ivp(slope, (0.0, times[-1]), start, t_eval=times, rtol=1e-9, atol=1e-11).y[:2].T


def _move(parameters: dict[str, float], times: Floats) -> tuple[Frames, Faces]:
    s, across, faces = _tube()
    angles = _angles(parameters, times)
    fine = np.linspace(0.0, LENGTH, 600)
    # the joint is at the same place of the rope in the data, so that a sequence differs by its motion alone
    fraction = smoothstep(fine, 0.5 * (LENGTH - SOFT), 0.5 * (LENGTH + SOFT))
    phi = angles[:, :1] * (1.0 - fraction) + angles[:, 1:] * fraction
    tangent = np.stack([np.sin(phi), np.zeros_like(phi), -np.cos(phi)], axis=-1)
    step = fine[1]
    line = np.concatenate(
        [np.zeros((len(times), 1, 3)), np.cumsum(0.5 * step * (tangent[:, 1:] + tangent[:, :-1]), axis=1)], axis=1
    )
    at = np.rint(s / step).astype(int).clip(0, len(fine) - 1)
    normal = np.stack([np.cos(phi), np.zeros_like(phi), np.sin(phi)], axis=-1)[:, at]
    moved = line[:, at] + across[:, :1] * normal + across[:, 1:] * np.array([0.0, 1.0, 0.0])
    return moved + np.array([0.0, 0.0, 1.2 * LENGTH]), faces


KIND = Kind(
    "a soft rope that is pushed and swings: a nonlinear ODE",
    {"push": "rad/s", "joint": "", "damping": "1/s"},
    {"push": (1.0, 5.0), "joint": (0.35, 0.65), "damping": (0.2, 2.0)},
    sequences=60,
    rate=25.0,
    frames=51,
    move=_move,
)
