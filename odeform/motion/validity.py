"""Holds what is known of the validity of a model's motions: the bodies it was trained on, and physical limits."""

from collections.abc import Callable
from dataclasses import dataclass, field

from odeform.geometry.shape_similarity import ShapeSimilarity, compare_shapes
from odeform.motion.limits import Limits
from odeform.motion.recent import Recent, geometry_key
from odeform.schema import Parameters
from odeform.types import Floats, Geometry, Mesh, Times

__all__ = ["UNKNOWN", "Validity"]

COMPARED = 8  # shapes whose similarity is kept


@dataclass(frozen=True, eq=False)
class Validity:
    """`bodies` are the trained ones where they rest in the scene; none: the checkpoint does not hold them."""

    bodies: tuple[Mesh, ...] = ()
    limits: Limits = field(default_factory=Limits)
    untrained: str = "it moves as the trained body would, with an unknown error"
    """How a shape that was not trained moves, and how wrong that is."""
    error_band: Callable[[Parameters, Times, Callable[[], float] | None], Floats | None] = (
        lambda parameters, times, size: None
    )
    """(T, 2) mm at (T,) seconds: the RMSE that half, and nine in ten, of unseen motions stay below, or None; of the
    parameters and what tells the size of the motion (`Motion.size_mm`)."""
    knows_untrained_errors: bool = False
    """Whether `error_band` holds for shapes that were not trained."""
    _similarities: Recent[tuple[Geometry, ShapeSimilarity]] = field(
        default_factory=lambda: Recent(COMPARED), repr=False
    )

    def similarity(self, geometry: Geometry) -> ShapeSimilarity | None:
        """How similar a shape is to the trained bodies; None where they are not known. The last few are kept."""
        if not self.bodies:
            return None

        def compared() -> tuple[Geometry, ShapeSimilarity]:
            return geometry, compare_shapes(geometry, self.bodies)

        # an entry holds its geometry, whose id therefore stays its own
        return self._similarities.get(geometry_key(geometry), compared)[1]


UNKNOWN = Validity()
"""Nothing is known, and nothing checked for plausibility."""
