"""A scene: what is varied, what is fixed, and how one motion of it comes about."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.stats import qmc

from odeform.errors import InputError
from odeform.schema import Schema
from odeform.types import Mesh, MotionSequence

__all__ = ["Scene", "get_scene", "known_scenes"]


@dataclass(frozen=True)
class Scene:
    """A family of motions.

    `simulate(parameters, rate, **numerics)` runs one motion; `rest_mesh()` is a fine
    mesh of the undeformed body, for display. `fixed` are the physical quantities that do not vary, with units in
    their names, kept with every data set.
    """

    schema: Schema
    simulate: Callable[..., MotionSequence]
    rest_mesh: Callable[[], Mesh]
    step: float
    """The simulator's time step in seconds that this scene calls its truth."""
    count: int
    """Sequences of its own data set."""
    fixed: dict[str, float] = field(default_factory=dict)

    def sample(self, count: int, seed: int) -> list[dict[str, float]]:
        """`count` parameter sets, space-filling over the trained box (scrambled Sobol points).

        A longer list with the same seed starts with the shorter one.
        """
        parameters = self.schema.parameters
        sobol = qmc.Sobol(len(parameters), scramble=True, rng=np.random.default_rng(seed))
        points = sobol.random(1 << max(count - 1, 0).bit_length())[:count]
        return [
            {p.name: p.denormalise(2.0 * float(u) - 1.0) for p, u in zip(parameters, row, strict=True)}
            for row in points
        ]


def known_scenes() -> dict[str, Scene]:
    """All that can be simulated, by name."""
    from odeform.simulation.scenes import kick, mass_elastic

    return {scene.schema.scene: scene for scene in (mass_elastic.SCENE, kick.SCENE)}


def get_scene(name: str) -> Scene:
    """The scene of that name."""
    scenes = known_scenes()
    if name not in scenes:
        raise InputError(f"unknown scene {name!r}: expected one of {', '.join(scenes)}")
    return scenes[name]
