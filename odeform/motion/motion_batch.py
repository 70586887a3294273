"""Many motions of one geometry, each under parameters of its own."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from odeform.motion.base import Motion, SolveStats
from odeform.motion.recent import Recent
from odeform.motion.remade import Remade
from odeform.schema import Parameters
from odeform.types import Times

__all__ = ["BatchPoses", "BatchVertices", "MotionBatch"]

KEPT = 8  # single motions that are kept

BatchVertices = Float[np.ndarray, "batch points 3"] | Float[np.ndarray, "batch times points 3"]
BatchPoses = Float[np.ndarray, "batch 4 4"] | Float[np.ndarray, "batch times 4 4"]


class MotionBatch(Remade, Sequence[Motion]):
    """B motions of one geometry, in the order of their parameters: what `Predictor.solve_batch` returns.

    `batch[i]` is motion i alone. Here every motion is asked by itself, when it is needed; subclasses ask many at once.

    Examples:
        >>> import numpy as np
        >>> import odeform
        >>> batch = odeform.load("kick").solve_batch({"mass": np.linspace(0.5, 1.0, 4), "force": 140.0})
        >>> len(batch), batch.vertices(0.02).shape
        (4, (4, 2306, 3))
        >>> batch.vertices(np.array([0.0, 0.5])).shape, batch.pose(0.5).shape
        ((4, 2, 2306, 3), (4, 4, 4))
        >>> batch[1].parameters["force"], batch.parameters["mass"].shape
        (140.0, (4,))
    """

    def __init__(self, sets: Sequence[Parameters], one: Callable[[int], Motion]) -> None:
        """`sets` are all parameters of each motion, `one(i)` solves motion i."""
        self._sets, self._one = sets, one
        self._kept: Recent[Motion] = Recent(KEPT)

    def __len__(self) -> int:
        return len(self._sets)

    def __getitem__(self, index: Any) -> Any:
        """Motion `index`, or a list of motions for a slice."""
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        place = range(len(self))[index]
        return self._kept.get(place, lambda: self._one(place))

    def __iter__(self) -> Iterator[Motion]:
        return (self[index] for index in range(len(self)))

    @property
    def parameters(self) -> dict[str, Any]:
        """Parameters by name: values (B,) in the units of the schema; the object is one name."""
        first = self._sets[0]
        return {
            name: value if isinstance(value, str) else np.array([given[name] for given in self._sets])
            for name, value in first.items()
        }

    @property
    def stats(self) -> tuple[SolveStats, ...]:
        """How each motion was computed, (B,)."""
        return tuple(motion.stats for motion in self)

    @property
    def status(self) -> tuple[str, ...]:
        """(B,) as `Motion.status`: that of the solver, and from where on a motion is not physically possible."""
        return tuple(motion.status for motion in self)

    def vertices(self, t: float | Times) -> BatchVertices:
        """Computes (B, N, 3) float32 metres at time `t` in seconds; (B, T, N, 3) for (T,) times."""
        return np.stack([motion.vertices(t) for motion in self])

    def pose(self, t: float | Times) -> BatchPoses:
        """Returns the rigid parts, as of `Motion.pose`: (B, 4, 4), or (B, T, 4, 4) for (T,) seconds."""
        return np.stack([motion.pose(t) for motion in self])
