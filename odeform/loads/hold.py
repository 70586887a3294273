"""Load `hold`: a body is held in the air by a patch of its surface, hangs from it and swings."""

from dataclasses import replace

import numpy as np
from scipy.spatial import KDTree

from odeform.errors import InputError
from odeform.geometry.directions import even_directions
from odeform.loads.arrow import Arrow
from odeform.loads.drop import PARAMETERS, WINDOW, height_of, turn_of
from odeform.loads.load import Load
from odeform.loads.situation import Clamp, Flight, Situation
from odeform.schema import Parameter, Parameters
from odeform.types import Mesh, Points, Vector

__all__ = ["LOAD", "held_towards", "held_vertex"]

WIDTH = Parameter(
    "held_width",
    "%",
    8.0,
    25.0,
    12.0,
    description="of the held patch, relative to the body's size: from its middle to where its springs are softer by a "
    "factor e",
)
LEAST = 3  # vertices: fewer hold no patch, but a point about which the body turns
FREE = 0.05  # of the stiffness in the middle: a vertex that is held less is free
SINK, DAMPING = 5e-4, 2e-3  # m and s, of the springs
DIRECTIONS = 4000  # that are looked at for the one in which a place is held
LENGTH = 0.25  # of the body's size: the arrow that points at the patch
HEIGHT = replace(PARAMETERS[0], default=0.3)


def _towards(parameters: Parameters) -> Vector:
    """(3,) the unit vector from the middle of the resting body towards where it is held."""
    around, up = (np.radians(float(parameters[name])) for name in ("held_around", "held_up"))
    if not np.isfinite([around, up]).all():
        raise InputError("held_around, held_up: expected finite angles in degrees")
    return np.array([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)])


def held_vertex(points: Points, parameters: Parameters) -> int:
    """The vertex of a resting body (N, 3) m that is nearest to a place far away in the direction asked for."""
    low, high = points.min(axis=0), points.max(axis=0)
    far = 0.5 * (low + high) + float((high - low).max()) * _towards(parameters)
    return int(((points - far) ** 2).sum(axis=1).argmin())


def situation(rest: Mesh, parameters: Parameters) -> Situation:
    """The body in the air, held."""
    flight = Flight(height_of(parameters), turn_of(parameters))
    points, vertex = np.asarray(rest.points, dtype=float), held_vertex(rest.points, parameters)
    radius = _radius(points, vertex, parameters)
    return Situation(flight, clamp=Clamp(vertex, radius, SINK, DAMPING))


def _radius(points: Points, vertex: int, parameters: Parameters) -> float:
    """m: of the patch around a vertex of a resting body (N, 3) m; `InputError` where it holds nothing, or all."""
    width = float(parameters.get(WIDTH.name, WIDTH.default))  # data of before it could be chosen do not have it
    if not 0.0 < width < np.inf:
        raise InputError(f"held_width: expected more than 0 % of the body's size, got {width:g}, which holds nothing")
    radius = 1e-2 * width * float(np.ptp(points, axis=0).max())
    held = np.exp(-((points - points[vertex]) ** 2).sum(axis=1) / radius**2)
    count = int((held > np.exp(-1.0)).sum())
    if count < LEAST and width < WIDTH.default:  # a coarse body is held at any rate as it was before there were widths
        raise InputError(
            f"held_width: expected a patch of at least {LEAST} vertices of the body, got {width:g} % of its size, "
            f"which holds {count}"
        )
    if held.min() > FREE:
        raise InputError(
            f"held_width: expected a patch that leaves a part of the body free, got {width:g} % of its size, which "
            "holds the whole body"
        )
    return radius


def held_towards(rest: Mesh, place: Vector) -> dict[str, float]:
    """The angles under which the held vertex of a resting body is nearest to a place (3,) m on it. Some places, such as
    the inside of a ring, are behind others under all angles."""
    points = np.asarray(rest.points, dtype=float)
    directions = even_directions(DIRECTIONS)
    low, high = points.min(axis=0), points.max(axis=0)
    far = 0.5 * (low + high) + float((high - low).max()) * directions
    vertices = KDTree(points).query(far)[1]
    away = ((points[vertices] - place) ** 2).sum(axis=1)
    mean = directions[away <= away.min()].mean(axis=0)
    # of the directions in which one vertex is held, the one in their middle: the next vertex is far away
    x, y, z = directions[np.where(away <= away.min(), directions @ mean, -np.inf).argmax()]
    up, around = np.degrees([np.arcsin(z), np.arctan2(y, x)])
    return {"held_around": round(float(around), 1), "held_up": round(float(up), 1)}


def arrows(start: Mesh, parameters: Parameters) -> tuple[Arrow, ...]:
    """An arrow that points from outside at the patch, as long as it is held."""
    turn, points = turn_of(parameters), np.asarray(start.points, dtype=float)
    resting = points @ turn
    vector = -LENGTH * float(np.ptp(resting, axis=0).max()) * (turn @ _towards(parameters))
    vertex = held_vertex(resting, parameters)
    return (Arrow(points[vertex] - vector, vector, "held", 0.0, np.inf, vertex=vertex),)


LOAD = Load(
    name="hold",
    title="Hold it",
    happened="held",
    parameters=(
        Parameter(
            "held_around",
            "deg",
            -180.0,
            180.0,
            -120.0,
            description="of the held patch about z, from the middle of the body",
        ),
        Parameter(
            "held_up",
            "deg",
            -90.0,
            90.0,
            30.0,
            description="of the held patch above the horizontal, from the middle",
        ),
        HEIGHT,
        *PARAMETERS[1:],
        WIDTH,
    ),
    window=WINDOW,
    until=3.0,
    situation=situation,
    presets={
        "by its side": {"held_up": 0.0},
        "from above": {"held_up": 90.0},
        "like a pendulum": {"held_up": 60.0, "turn_y": -60.0},
        "by a wide patch": {"held_up": 0.0, "held_width": 25.0},
        "upside down": {"held_up": -60.0, "turn_x": 180.0},
        "it touches the floor": {"held_up": 0.0, "height": 0.05},
    },
    notes=(
        "The body begins in the air, without stress. Springs and dampers hold a patch of its surface where it begins; "
        "they get softer with the distance from its middle, to a third at the width of the patch.",
    ),
    arrows=arrows,
    pick=held_towards,
    picks="where it is held",
    held=True,
)
