"""The shape in which a soft object rests on the floor."""

from dataclasses import replace

import numpy as np

from odeform.geometry.solids.tetrahedra import inside_out
from odeform.simulation.errors import SimulationError
from odeform.simulation.objects.body import SoftBody
from odeform.simulation.objects.soft_object import SoftMaterial, SoftObject
from odeform.types import Ints, Points

__all__ = ["REST_SPEED", "STEP", "calmed", "rested", "settle"]

STEP, COARSE = 5e-4, 2e-3  # s
REST_SPEED = 1e-3  # m/s, RMS over the mass; a body counts as settled at a fifth of it
CALM, LIMIT, UNDAMPED = 20, 3000, 100  # steps that slow before it counts; steps at most; undamped steps at the end


def settle(points: Points, elements: Ints, material: SoftMaterial, start: Points | None = None) -> Points:
    """(N, 3) m, the nodes at rest on the floor z = 0, their mass centred at x = y = 0.

    The body starts at `start` (N, 3) m, by default without stress where it touches the floor, and loses its velocity
    whenever its kinetic energy passes a maximum (kinetic damping); without a start in coarse steps first. Then it moves
    freely for 0.05 s. Raises `SimulationError` if it is still moving after that, or if tetrahedra are inside out: parts
    too thin for this material collapse under the weight.
    """
    positions = points - [0.0, 0.0, points[:, 2].min()] if start is None else start
    for step in (COARSE, STEP) if start is None else (STEP,):
        positions = calmed(_body(points, elements, material, step, positions))
    body = _body(points, elements, material, STEP, positions)
    for _ in range(UNDAMPED):
        body.step()
    body.check()
    speed = np.sqrt(_energy(body))
    if not speed < REST_SPEED:
        raise SimulationError(f"the body does not come to rest: {1e3 * speed:.2f} mm/s after settling")
    if inverted := int(inside_out(positions, elements).sum()):
        raise SimulationError(
            f"parts of it collapse under its weight: {inverted} of {len(elements)} tetrahedra are inside out"
        )
    return positions - (body.weights @ positions) * [1.0, 1.0, 0.0]


def rested(item: SoftObject) -> SoftObject:
    """A body that was laid on the floor without the simulator, where it rests in the simulator."""
    return replace(item, settled=settle(item.points, item.elements, item.material, item.settled))


def _body(points: Points, elements: Ints, material: SoftMaterial, step: float, positions: Points) -> SoftBody:
    body = SoftBody(points, elements, material, step)
    body.positions = positions
    return body


def calmed(body: SoftBody) -> Points:
    """(N, 3) m, where a body is that loses its velocity whenever its kinetic energy passes a maximum, until it is slow
    or the steps are spent."""
    energy, calm = 0.0, 0
    for _ in range(LIMIT):
        body.step()
        before, energy = energy, _energy(body)
        calm = calm + 1 if energy < (0.2 * REST_SPEED) ** 2 else 0
        if energy < before:
            body.velocities[:] = 0.0
            energy = 0.0
        if calm >= CALM:
            break
    return body.positions


def _energy(body: SoftBody) -> float:
    """Mean square of the speed over the mass, in m^2/s^2."""
    return float(body.weights @ (body.velocities**2).sum(axis=1))
