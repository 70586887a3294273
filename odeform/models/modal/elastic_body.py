"""A soft body of a mechanical model: its surface, its modes there, and the arrays of a checkpoint that hold them."""

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from odeform.geometry.rigid import best_rigid
from odeform.mechanics.body import SUPPORT, ReducedBody, Solid, reduce_body, solid_of
from odeform.mechanics.elasticity import elastic_modes, tangent_stiffness
from odeform.mechanics.warping import surface_turns
from odeform.simulation.objects.soft_object import SoftObject
from odeform.types import Arrays, Faces, Perpoint, Points

__all__ = ["ElasticBody", "elastic_body"]

MODES, DYNAMIC = 120, 24


@dataclass(frozen=True, eq=False)
class ElasticBody:
    """A soft body's surface of S vertices, its M softest modes there, and what it is as a whole.

    The first K modes move by their own dynamics. The others are too fast for that: they follow the push (static
    correction of modal analysis; Craig and Kurdila 2006, Fundamentals of Structural Dynamics, 11.4).
    """

    points: Points
    """(S, 3) m at rest in the scene."""
    faces: Faces
    weights: Perpoint
    """(S,) mass fraction."""
    modes: Float[np.ndarray, "modes points 3"]
    """m per root kilogram."""
    eigenvalues: Float[np.ndarray, " modes"]
    """1/s^2."""
    dynamic: int
    """K."""
    solid: Solid
    anchor: Float[np.ndarray, "3"]
    """(3,) m: the mass centre."""
    free: Float[np.ndarray, " modes"] | None = None
    """Amplitudes without stress, in root kg m; None in files of before bodies could fly."""

    def reduced(self, support: int = SUPPORT) -> ReducedBody:
        """Converts it to the body that the mechanics takes, of which about `support` points may touch the floor."""
        if support not in self._reduced:
            self._reduced[support] = reduce_body(
                self.points - self.anchor,
                self.faces,
                self.modes,
                self.modal_rotations,
                self.eigenvalues,
                self.solid,
                self.weights.astype(float),
                support,
            )
        return self._reduced[support]

    @cached_property
    def _reduced(self) -> dict[int, ReducedBody]:
        """What was converted: bodies of other masses are made of it."""
        return {}

    @cached_property
    def modal_rotations(self) -> Float[np.ndarray, "points 3 modes"]:
        """Rotations of the surface by the modes, rad per root kilogram."""
        return surface_turns(self.points, self.faces, self.modes.transpose(1, 2, 0))

    def arrays(self) -> Arrays:
        """The arrays of a checkpoint, besides those of the body that viewers show."""
        return {
            "body.modes": self.modes.astype(np.float16),
            "body.squares": self.eigenvalues,
            "body.weights": self.weights,
            "body.anchor": self.anchor,
            "body.inertia": self.solid.inertia,
            **({} if self.free is None else {"body.free": self.free}),
        }

    def shown(self) -> Arrays:
        """The arrays of a checkpoint that viewers show."""
        return {"rest.points": self.points.astype(np.float32), "rest.faces": self.faces.astype(np.int32)}

    def to_json(self) -> dict[str, Any]:
        """Returns the numbers of a checkpoint."""
        numbers = {key: value for key, value in asdict(self.solid).items() if key != "inertia"}
        return {**numbers, "dynamic": self.dynamic}

    @classmethod
    def from_parts(cls, arrays: Arrays, numbers: dict[str, Any]) -> "ElasticBody":
        """The inverse of `arrays` and `to_json`; KeyError or TypeError where something is missing."""
        dynamic = int(numbers["dynamic"])
        solid = Solid(inertia=arrays["body.inertia"], **{k: v for k, v in numbers.items() if k != "dynamic"})
        points = arrays["rest.points"].astype(float)
        modes, eigenvalues = arrays["body.modes"].astype(float), arrays["body.squares"]
        return cls(
            points,
            arrays["rest.faces"],
            arrays["body.weights"],
            modes,
            eigenvalues,
            dynamic,
            solid,
            arrays["body.anchor"],
            arrays.get("body.free"),
        )


def elastic_body(body: SoftObject, count: int = MODES, dynamic: int = DYNAMIC) -> ElasticBody:
    """The `count` softest modes of a soft object at its surface; `dynamic` of them move by themselves."""
    material, masses = body.material, body.masses
    stiffness = tangent_stiffness(
        body.points, body.elements, body.settled, material.young, material.poisson, material.thickness
    )
    modes = elastic_modes(stiffness, masses, body.settled, count)
    surface = slice(0, body.surface_count)
    solid = solid_of(body.settled, masses, material.damping)
    anchor = masses @ body.settled / masses.sum()
    points = body.settled[surface].astype(np.float32).astype(float)
    # as a checkpoint holds them, so that training and prediction use the same
    shapes = modes.shapes[:, surface].astype(np.float16).astype(float)
    free = modes.shapes.reshape(len(modes.shapes), -1) @ (masses[:, None] * _unloading(body)).ravel()
    return ElasticBody(points, body.faces, body.weights, shapes, modes.eigenvalues, dynamic, solid, anchor, free)


def _unloading(body: SoftObject) -> Points:
    """(N, 3) m by which nodes move from where they rest to where they would be without stress, the whole body aside."""
    turn, shift = best_rigid(body.points, body.settled, fractions := body.masses / body.mass)
    centre = fractions @ body.points
    return (body.points - centre) @ turn.T + centre + shift - body.settled
