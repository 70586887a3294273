"""Scenes in which a load of `odeform.loads` acts on one of the seven objects: `object-drop`, `object-throw`, ..."""

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.geometry.contact import SurfacePoint
from odeform.geometry.twins import twin_faces
from odeform.loads.arrow import Arrow
from odeform.loads.kick import STRONGER
from odeform.loads.load import Load
from odeform.loads.obstacle import Obstacle
from odeform.schema import OBJECT, Parameters, Schema
from odeform.simulation.loaded import STEP, released, simulate_situation
from odeform.simulation.objects.catalog import OBJECTS, SHELLS, get_object
from odeform.simulation.objects.materials import forces_at
from odeform.simulation.objects.soft_object import SoftObject
from odeform.simulation.physics import GRAVITY
from odeform.simulation.scene import Scene, evenly
from odeform.simulation.scenes.contact_force import changed_object, drawn_on
from odeform.surroundings import Contacts
from odeform.types import Mesh, MotionSequence, Points

__all__ = ["drawn_apart", "forces_of", "scene_of", "simulate_load", "start_of"]

COUNT = 24  # sequences of each object in a standard data set


def simulate_load(
    load: Load,
    item: SoftObject,
    parameters: Parameters,
    rate: float | None = None,
    step: float = STEP,
    report: Callable[[float], None] = lambda _: None,
    until: float | None = None,
) -> MotionSequence:
    """One motion of the surface of any soft object under a load to `until` seconds (default: over the load's window),
    with frames at `rate` Hz. Beyond the window it ends where the body rests.

    Contacts are places on `item` as it rests, and move with its surface where `mass` or `young` change it. Raises
    `InputError` for what the load does not have, and `SimulationError`.
    """
    if load.pairs and item.elements.shape[1] == 3:
        raise InputError(f"{item.name}: it is a shell, which has no inside; expected a solid to throw at another")
    window, until = load.window, until or load.window.stop
    situation = load.situation(item.rest_mesh(), parameters)
    item = changed_object(item, parameters)
    times, vertices = simulate_situation(item, situation, rate or window.rate, until, step, until > window.stop, report)
    faces, weights = item.faces, item.weights
    if load.pairs:
        faces, weights = twin_faces(faces, item.surface_count), 0.5 * np.concatenate([weights, weights])
    return MotionSequence(times, vertices, faces, weights, dict(parameters))


def start_of(load: Load, item: SoftObject, parameters: Parameters) -> Mesh:
    """The surface of the body that is thrown, or rests, where its motion begins."""
    situation = load.situation(item.rest_mesh(), parameters)
    item = changed_object(item, parameters)
    points, _ = released(item, situation.flight)
    return Mesh(points[: item.surface_count].astype(np.float32), item.faces)


def forces_of(item: SoftObject, contact: SurfacePoint | None = None) -> tuple[float, float]:
    """The weakest and the strongest peak of a kick on a body, in newton; at a contact, where one is given."""
    weakest, strongest = item.forces if contact is None else forces_at(item, contact)
    return STRONGER * weakest, STRONGER * strongest


@cache
def scene_of(load: Load) -> Scene:
    """The scene in which a load acts on the seven objects."""
    objects = tuple(name for name in OBJECTS if not (load.pairs and name in SHELLS))
    schema = Schema(load.scene, load.parameters, load.window, notes=load.notes, objects=objects)

    def simulate(parameters: Parameters, **options: Any) -> MotionSequence:
        return simulate_load(load, get_object(parameters[OBJECT]), parameters, **options)

    def draw(name: str, count: int, seed: int) -> list[dict[str, Any]]:
        item = get_object(name)
        return drawn_on(item, forces_of(item), count, seed)

    def apart(name: str, count: int, seed: int) -> list[dict[str, Any]]:
        return drawn_apart(load, get_object(name).rest_mesh(), count, seed)

    def glyphs(parameters: Parameters, points: Points) -> tuple[Arrow, ...]:
        if not {p.name for p in load.parameters} <= set(parameters):
            return ()
        rest = Mesh(points, np.zeros((0, 3), np.int32))
        return load.arrows(_begun(rest, load, parameters), parameters)

    def obstacles(parameters: Parameters) -> tuple[Obstacle, ...]:
        return load.obstacles(parameters) if {p.name for p in load.parameters} <= set(parameters) else ()

    contacts = None
    if load.pulse is not None:
        contacts = Contacts({name: forces_of(get_object(name)) for name in OBJECTS}, load.pulse, 0.0)
    return Scene(
        schema=schema,
        simulate=simulate,
        rest_mesh=partial(_rest_mesh, OBJECTS[0]),
        step=STEP,
        count=COUNT,
        fixed={"gravity_m_s2": GRAVITY},
        until=load.until,
        glyphs=glyphs,
        obstacles=obstacles,
        contacts=contacts,
        sampler=draw if load.pulse is not None else apart if load.pairs else None,
    )


def drawn_apart(load: Load, rest: Mesh, count: int, seed: int) -> list[dict[str, Any]]:
    """Draws `count` sets of parameters evenly, without those under which a body begins inside another."""
    tried, found = count, list[dict[str, Any]]()
    while True:
        drawn = evenly(load.parameters, tried, seed)
        found = [row for row in drawn if _begins(load, rest, row)]
        if len(found) >= count:
            return found[:count]
        tried *= 2


def _begins(load: Load, rest: Mesh, parameters: Parameters) -> bool:
    try:
        load.situation(rest, parameters)
    except InputError:
        return False
    return True


def _begun(rest: Mesh, load: Load, parameters: Parameters) -> Mesh:
    """About where a body begins that rests there, as of `Flight.placed`."""
    if not load.flies or (flight := load.situation(rest, parameters).flight) is None:
        return rest
    return Mesh(flight.placed(rest.points).astype(np.float32), rest.faces)


def _rest_mesh(name: str) -> Mesh:
    return get_object(name).rest_mesh()
