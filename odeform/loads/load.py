"""Defines a load: what happens to a soft body, with the sliders and the picture of it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from odeform.loads.arrow import Arrow
from odeform.loads.obstacle import Obstacle
from odeform.loads.situation import Situation
from odeform.schema import Parameter, Parameters, Window
from odeform.types import Mesh, Vector

__all__ = ["SCENES_OF_LOADS", "Load"]

SCENES_OF_LOADS = "object-"
"""Start of the names of scenes in which a load acts on an object; the name of the load follows."""


def _no_arrows(rest: Mesh, parameters: Parameters) -> tuple[Arrow, ...]:
    return ()


def _no_obstacles(parameters: Parameters) -> tuple[Obstacle, ...]:
    return ()


@dataclass(frozen=True, eq=False)
class Load:
    """What happens to a body that lies on the floor or begins in the air.

    A load is one file: a module-level value, named in `odeform.loads.registry`, or given to `register_load`.
    """

    name: str
    """As in "drop"."""
    title: str
    """As in "Drop it", for the page."""
    parameters: tuple[Parameter, ...]
    """Its sliders. Mass and stiffness of the body come on top."""
    window: Window
    """The time over which its motions are scored, and how often."""
    until: float
    """s to which a motion on demand is simulated, unless the body rests before."""
    situation: Callable[[Mesh, Parameters], Situation]
    """`situation(rest, parameters)` for the body where it rests on the floor. `InputError` for parameters that describe
    nothing that can happen."""
    presets: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Values worth seeing, by a name for people; defaults for what they leave out."""
    notes: tuple[str, ...] = ()
    """Remarks for people."""
    happened: str = ""
    """What stands behind the name of the body, as in "dropped"; the title where it is empty."""
    arrows: Callable[[Mesh, Parameters], tuple[Arrow, ...]] = _no_arrows
    """`arrows(start, parameters)` are what a viewer draws at the body where its motion begins."""
    obstacles: Callable[[Parameters], tuple[Obstacle, ...]] = _no_obstacles
    """`obstacles(parameters)` are what the body meets besides the floor, as many for all parameters."""
    pulse: float | None = None
    """s: how long a force acts at a contact that one chooses on the surface of the body on the floor, with parameters
    `contact_x` to `_z` and `force_x` to `_z`; None for a load under which it begins in the air."""

    pick: Callable[[Mesh, Vector], Mapping[str, float]] | None = None
    """`pick(rest, place)` are the parameters that a click on the body sets, at a place (3,) m of it where it rests on
    the floor; None for a load under which clicks mean nothing."""
    picks: str = ""
    """What such a click chooses, as in "where it is held"."""

    held: bool = False
    """Whether a patch of the body is held: it deforms as its own modulus and damping say, and not as what was fitted to
    impacts, which makes up for what modes leave out there."""

    pairs: bool = False
    """Whether the body meets a twin of itself: motions are those of both, one after the other. Shells cannot."""

    @property
    def flies(self) -> bool:
        """Whether the body begins in the air, and not where it rests on the floor."""
        return self.pulse is None

    @property
    def scene(self) -> str:
        """The name of the scene in which it acts on the objects."""
        return SCENES_OF_LOADS + self.name
