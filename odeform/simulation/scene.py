"""A scene: a family of motions, with everything that the rest of the package needs to know of it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from odeform.loads.arrow import Arrow
from odeform.loads.obstacle import Obstacle
from odeform.schema import OBJECT, Parameter, Parameters, Schema
from odeform.simulation.physics import GRAVITY, STANDARD_CHECKS, PhysicalCheck
from odeform.surroundings import Contacts, Surroundings
from odeform.types import Mesh, MotionSequence, Points

__all__ = ["Scene", "evenly"]


def _no_glyphs(parameters: Parameters, rest_points: Points) -> tuple[Arrow, ...]:
    return ()


def _no_obstacles(parameters: Parameters) -> tuple[Obstacle, ...]:
    return ()


@dataclass(frozen=True)
class Scene:
    """A family of motions of one body. Only `schema` to `count` are required.

    A scene is a module-level value, named in `odeform.simulation.scenes.registry`. Its functions should import their
    simulator when they are called: looking at a scene, or training on its data, needs none.
    """

    schema: Schema
    """Its name, parameters and time window."""
    simulate: Callable[..., MotionSequence]
    """`simulate(parameters, rate=Hz, step=s)` runs one motion. It also takes `report`, a function of the fraction done,
    and `resolution`, if the scene has `resolutions`. It raises `SimulationError` where the result is not sound."""
    rest_mesh: Callable[[], Mesh]
    """A fine mesh of the undeformed body where the motion starts, for display; of the default object, if there are
    several."""
    step: float
    """Time step of the simulator in seconds whose results count as the truth."""
    count: int
    """Number of sequences in its standard data set, for each object. Data beyond it are for training."""
    fixed: dict[str, float] = field(default_factory=dict)
    """Physical quantities that do not vary, with units in their names. They are stored with every data set."""
    gravity: float = GRAVITY
    """m/s^2, along -z."""
    floor: float | None = 0.0
    """Height in metres of the floor, which no motion may pass; None for a scene without one."""
    until: float | None = None
    """Seconds to which a motion on demand is simulated, unless the body rests before; None: over the window. `simulate`
    then takes it as `until`."""
    resolutions: tuple[int, ...] = ()
    """Resolutions of the simulated mesh, finest first. The first counts as the truth; none: it cannot be changed."""
    glyphs: Callable[[Parameters, Points], tuple[Arrow, ...]] = _no_glyphs
    """`glyphs(parameters, rest_points)` are the arrows that show the parameters on a body of points (N, 3) m."""
    obstacles: Callable[[Parameters], tuple[Obstacle, ...]] = _no_obstacles
    """`obstacles(parameters)` are what the body meets besides the floor."""
    checks: tuple[PhysicalCheck, ...] = STANDARD_CHECKS
    """Bounds that `odeform stress` checks predicted motions against."""
    contacts: Contacts | None = None
    """Says, in scenes in which a sphere pushes a body, how strongly and for how long."""
    sampler: Callable[[str, int, int], list[dict[str, Any]]] | None = None
    """`sampler(object, count, seed)` draws `count` parameter sets of one object ("" in a scene without any), for scenes
    whose parameters do not fill a box. A longer list starts with the shorter one. None: evenly over the box."""

    @property
    def surroundings(self) -> Surroundings:
        """Floor, gravity and contacts, as data sets and checkpoints keep them."""
        return Surroundings(self.floor, self.gravity, self.contacts)

    def sample(self, count: int, seed: int, objects: Sequence[str] = ()) -> list[dict[str, Any]]:
        """`count` complete parameter sets; in a scene with objects, `count` of each of `objects` (default: all).

        By default they fill the trained box evenly (scrambled Sobol points); see `sampler`. A longer list of one object
        with the same seed starts with the shorter one.
        """
        draw = self.sampler or self._fill_box
        if not self.schema.objects:
            return draw("", count, seed)
        rows = ({OBJECT: name, **row} for name in objects or self.schema.objects for row in draw(name, count, seed))
        return [self.schema.complete(row) for row in rows]

    def _fill_box(self, _: str, count: int, seed: int) -> list[dict[str, Any]]:
        return evenly(self.schema.parameters, count, seed)


def evenly(parameters: Sequence[Parameter], count: int, seed: int) -> list[dict[str, Any]]:
    """`count` values of parameters that fill their ranges evenly (scrambled Sobol points). A longer list with the same
    seed starts with the shorter one."""
    from scipy.stats import qmc  # takes half a second to import, and looking at a scene does not need it

    sobol = qmc.Sobol(len(parameters), scramble=True, rng=np.random.default_rng(seed))
    points = sobol.random(1 << max(count - 1, 0).bit_length())[:count]
    return [
        {p.name: p.denormalise(2.0 * float(u) - 1.0) for p, u in zip(parameters, row, strict=True)} for row in points
    ]
