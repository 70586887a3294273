"""Load `step`: a body is thrown at a step: onto it, or against its edge."""

import numpy as np

from odeform.errors import InputError
from odeform.loads.drop import PARAMETERS, WINDOW
from odeform.loads.load import Load
from odeform.loads.obstacle import Obstacle
from odeform.loads.situation import Situation, beginning_outside
from odeform.loads.throw import SPINS, arrows, flight_of, velocity
from odeform.loads.wall import DISTANCE, distance_of
from odeform.schema import Parameter, Parameters
from odeform.surroundings import GRAVITY
from odeform.types import Mesh

__all__ = ["LOAD"]

DEEP, WIDE = 0.5, 0.5  # m: along x, and to each side
HEIGHT = Parameter("height", "m", 0.18, 0.4, 0.25, description="of the body's lowest point above the floor")


def step(distance: float, rise: float) -> Obstacle:
    """A box on the floor that begins at x = distance m. It has no lower side, through which nothing could leave it."""
    low, high = np.array([0.0, -WIDE, -np.inf]), np.array([DEEP, WIDE, rise])
    shown = np.array([0.0, -WIDE, 0.0]), high
    return Obstacle(np.array([distance, 0.0, 0.0]), low, high, shown, name="step")


def rise_of(parameters: Parameters) -> float:
    """Metres; `InputError` for a step that is none, or that the throw does not reach."""
    rise, flight = float(parameters["rise"]), flight_of(parameters)
    highest = flight.height + max(float(flight.velocity[2]), 0.0) ** 2 / (2.0 * GRAVITY)
    if not 0.0 < rise <= highest:
        raise InputError(
            f"rise: expected a step of more than 0 m, and not higher than the throw, "
            f"whose lowest point gets to {highest:.2g} m; got {rise:g}"
        )
    return rise


def obstacles(parameters: Parameters) -> tuple[Obstacle, ...]:
    """The step."""
    return (step(distance_of(parameters), rise_of(parameters)),)


def situation(rest: Mesh, parameters: Parameters) -> Situation:
    """The body in the air, on its way to the step."""
    return beginning_outside(rest, flight_of(parameters), obstacles(parameters), "step")


LOAD = Load(
    name="step",
    title="Throw it onto a step",
    happened="thrown onto a step",
    parameters=(
        DISTANCE,
        Parameter("rise", "m", 0.03, 0.15, 0.08, description="height of the step"),
        HEIGHT,
        *PARAMETERS[1:],
        velocity("x", 1.0, 2.5, 1.5),
        velocity("y", -0.5, 0.5, 0.0),
        velocity("z", -0.5, 1.5, 0.5),
        *SPINS,
    ),
    window=WINDOW,
    until=2.0,
    situation=situation,
    presets={
        "onto it": {"velocity_x": 2.0, "velocity_z": 1.0, "spin_y": 0.0},
        "against its edge": {"distance": 0.25, "velocity_x": 1.2, "velocity_z": 0.0, "rise": 0.12, "spin_y": 0.0},
        "a somersault over the edge": {"velocity_x": 1.6, "velocity_z": 1.2, "spin_y": 9.0},
        "it lands before it": {"velocity_x": 1.0, "velocity_z": -0.5, "distance": 0.5},
    },
    notes=("The body begins in the air, without stress. The step is as rough and stiff as the floor.",),
    arrows=arrows,
    obstacles=obstacles,
)
