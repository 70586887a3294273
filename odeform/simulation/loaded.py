"""Simulates a soft body in any situation: the truth that predicted drops, throws and kicks are held against."""

from collections.abc import Callable

import numpy as np

from odeform.geometry.rigid import best_rigid
from odeform.geometry.solids.tetrahedra import inside_out
from odeform.loads.situation import Clamp, Flight, Pulse, Situation, pulse_strength
from odeform.simulation.errors import SimulationError
from odeform.simulation.objects.soft_object import SoftObject
from odeform.simulation.stepping import Body, Rest, run
from odeform.types import Floats, Frames, Points, Times

__all__ = ["STEP", "begun", "released", "simulate_situation"]

STEP = 5e-4  # s
REST = Rest(speed=1e-3, time=0.05)


def simulate_situation(
    item: SoftObject,
    situation: Situation,
    rate: float,
    until: float,
    step: float = STEP,
    rests: bool = False,
    report: Callable[[float], None] = lambda _: None,
) -> tuple[Times, Frames]:
    """Times (T,) s at `rate` Hz to `until` s, and the surface (T, S, 3) m there, of two bodies the one's and then the
    other's. With `rests`, it ends where the body rests.

    A pulse's place is one of the body's settled surface. `report` gets the fraction done. Raises `SimulationError`.
    """
    from odeform.simulation.inversion import GuardedBody  # looking at a scene needs no simulator
    from odeform.simulation.objects.body import SoftBody, contact_of
    from odeform.simulation.obstacles import obstacle_xml

    others = obstacle_xml(situation.obstacles, contact_of(item.material))
    bodies = 1 if situation.twin is None else 2
    body = SoftBody(item.points, item.elements, item.material, step, others=others, bodies=bodies)
    body.positions, body.velocities[:] = begun(item, situation)
    points, elements = np.tile(item.points, (bodies, 1)), item.elements
    if situation.twin is not None:
        elements = np.concatenate([elements, elements + len(item.points)])
    solid = item.elements.shape[1] == 4
    times, nodes = run(
        GuardedBody(body, points, elements) if solid else body,
        until,
        rate,
        _force(item, situation, body),
        rest=REST if rests else None,
        report=lambda now: report(now / until),
    )
    if solid and (inverted := int(inside_out(nodes[-1], elements).sum())):
        raise SimulationError(f"{inverted} of {len(elements)} tetrahedra are inside out at the end")
    surface = nodes.reshape(len(times), bodies, -1, 3)[:, :, : item.surface_count]
    return times, surface.reshape(len(times), -1, 3).astype(np.float32)


def begun(item: SoftObject, situation: Situation) -> tuple[Points, Points]:
    """Where the nodes of all bodies (N, 3) m begin, and how fast, in m/s."""
    positions, velocities = released(item, situation.flight)
    if situation.twin is None:
        return positions, velocities
    other = situation.twin.placed(item.settled, item.masses @ item.settled / item.mass)
    return np.concatenate([positions, other]), np.concatenate([velocities, np.zeros_like(other)])


def released(item: SoftObject, flight: Flight | None) -> tuple[Points, Points]:
    """Where the nodes (N, 3) m begin, and how fast, in m/s: at rest on the floor, or in the air as a rigid body without
    stress, with the mass centre at x = y = 0."""
    if flight is None:
        return item.settled, np.zeros_like(item.settled)
    fractions = item.masses / item.mass
    # the body without stress, as it lies when it rests
    turn, _ = best_rigid(item.points, item.settled, fractions)
    arms = (item.points - fractions @ item.points) @ (flight.rotation @ turn).T
    height = flight.height - float(arms[: item.surface_count, 2].min())
    return arms + np.array([0.0, 0.0, height]), flight.velocity + np.cross(flight.spin, arms)


def _force(item: SoftObject, situation: Situation, body: Body) -> Callable[[float], Floats | None]:
    """(N, 3) N at the nodes over time, besides weight and contacts."""
    if situation.pulse is not None:
        return _kicking(item, situation.pulse)
    return _holding(item, situation.clamp, body) if situation.clamp is not None else lambda _: None


def _kicking(item: SoftObject, pulse: Pulse) -> Callable[[float], Floats | None]:
    count = item.surface_count
    weights = np.zeros(len(item.points))
    weights[:count] = pulse.weights(
        item.settled[:count], item.weights, pulse.place.moved(item.settled[:count], item.faces)
    )
    load = weights[:, None] * pulse.force
    return lambda time: float(pulse_strength(time, pulse.duration)) * load if time < pulse.duration else None


def _holding(item: SoftObject, clamp: Clamp, body: Body) -> Callable[[float], Floats]:
    count, out = item.surface_count, np.zeros_like(item.points)
    stiffness = clamp.stiffness(item.settled[:count], item.weights, item.mass)[:, None]
    begun = body.positions[:count]

    def force(_: float) -> Floats:
        moved = body.positions[:count] - begun + clamp.damping * body.velocities[:count]
        out[:count] = -stiffness * moved
        return out

    return force
