"""The trained body in reduced coordinates: how low it reaches and how far it deforms, cheaply, at many times."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from odeform.geometry.directions import even_directions
from odeform.loads.obstacle import Obstacle
from odeform.motion.evaluated_basis import EvaluatedBasis, evaluate_basis
from odeform.motion.plausibility import Sample
from odeform.motion.recent import Recent
from odeform.motion.reduced_space import POSE, ReducedSpace, rotation_of
from odeform.types import Floats, Ints, Mesh, PointCloud, Rotations, Times, Vectors

__all__ = ["CheckedBody", "checked_body"]

DRAWS, PARTS = 2048, 32  # of a direction and a deformation, for the points that represent the body; looked at together
SOFTEST = 120  # modes: what each moves the farthest represents the body as well
LARGER = 2.0  # times the largest trained deformation, up to which they are drawn
CLOSE = 1e-3  # m by which other points may be farther out
NEAR = 4.5e-3  # m above the floor's limit from which on all points are looked at: in 560 pushes none was as much lower


@dataclass(frozen=True, eq=False)
class CheckedBody:
    """All of its points, a few that may be the lowest, and the height in metres below which none may be."""

    all: EvaluatedBasis
    outermost: Ints
    """(M,) which these few are."""
    limit: float

    @cached_property
    def few(self) -> EvaluatedBasis:
        """The basis on those few."""
        return self.all.some(self.outermost)

    def sample(
        self,
        predicted: Float[np.ndarray, "times y"],
        windows: Float[np.ndarray, " times"],
        obstacles: tuple[Obstacle, ...] = (),
    ) -> Sample:
        """Samples the body at predictions (T, 6 + K), not yet bounded, in metres and radians, after `windows` (T,)
        as in `ReducedSpace.bounded`. As low as it is inside one of `obstacles`, it is at least."""
        space = self.all.space
        with np.errstate(all="ignore"):
            deformation = np.sqrt(np.square(predicted[:, POSE:]).sum(axis=1)) / space.largest[1]
            y = space.bounded(predicted, windows)
            heights, rotation, shift = self._at(y)
            inside = None
            if obstacles:
                places = _local(self.few, y) @ rotation.swapaxes(-1, -2) + (shift + space.anchor)[:, None]
                gaps = np.min([one.met(places)[0].min(axis=1) for one in obstacles], axis=0)
                heights, inside = np.minimum(heights, gaps), gaps < heights
            return Sample(heights, deformation, rotation @ self._centre + shift + space.anchor, inside)

    def lowest(self, predicted: Float[np.ndarray, "times y"]) -> Times:
        """Computes the heights (T,) in metres of the lowest point, at predictions (T, 6 + K) within the trained
        window."""
        with np.errstate(all="ignore"):
            return self._at(self.all.space.bounded(predicted, np.ones(len(predicted))))[0]

    def _at(self, y: Floats) -> tuple[Times, Rotations, Vectors]:
        """Heights, rotations and shifts at coordinates (T, 6 + K); the last are kept: motions are raised from the
        floor, and then checked, at the same moments."""

        def placed() -> tuple[Times, Rotations, Vectors]:
            rotation, shift = rotation_of(y[:, :POSE], 0.0)
            return self._heights(y, rotation, shift), rotation, shift

        return self._recent.get(y.tobytes(), placed)

    @cached_property
    def _recent(self) -> Recent[tuple[Times, Rotations, Vectors]]:
        return Recent(1)

    def _heights(self, y: Floats, rotation: Rotations, shift: Vectors) -> Times:
        lowest = _lowest(self.few, y, rotation, shift)
        near = np.flatnonzero((lowest >= self.limit) & (lowest < self.limit + NEAR))
        if len(near):
            lowest[near] = _lowest(self.all, y[near], rotation[near], shift[near])
        return lowest

    @cached_property
    def _centre(self) -> Floats:
        return self.all.rest.mean(axis=0, dtype=float)


def _lowest(evaluated: EvaluatedBasis, y: Floats, rotation: Rotations, shift: Vectors) -> Times:
    """(T,) height in metres of the lowest point. The azimuth does not change it."""
    heights = (_local(evaluated, y) @ rotation[:, 2, :, None].astype(np.float32))[..., 0]
    return heights.min(axis=1).astype(float) + shift[:, 2] + evaluated.space.anchor[2]


def _local(evaluated: EvaluatedBasis, y: Floats) -> Floats:
    """(T, N, 3) m: the deformed points before the pose."""
    return (y[:, POSE:].astype(np.float32) @ evaluated.values).reshape(len(y), -1, 3) + evaluated.rest


def checked_body(rest: Mesh | PointCloud, space: ReducedSpace, limit: float) -> CheckedBody:
    """Evaluate the basis on the trained body at rest."""
    every = evaluate_basis(PointCloud(np.asarray(rest.points, dtype=float)), space, 0.0)
    return CheckedBody(every, _outermost(every), limit)


def _outermost(every: EvaluatedBasis) -> Ints:
    """A few points such that none is farther in any direction, at rest or deformed, by more than `CLOSE`, as far as
    draws tell."""
    rest, modes, largest = every.rest - every.rest.mean(axis=0), every.values, every.space.largest[1]
    directions, random = even_directions(DRAWS).astype(np.float32), np.random.default_rng(0)
    # softer modes have larger amplitudes, in some draws more so than in others: stiff ones move thin parts
    softer = (1.0 + np.arange(len(modes))) ** random.uniform(0.0, 0.5, (DRAWS, 1))
    amplitudes = random.normal(size=softer.shape) / softer
    sizes = np.linspace(0.0, LARGER * largest if np.isfinite(largest) else 0.0, DRAWS)
    amplitudes *= (sizes / np.maximum(np.linalg.norm(amplitudes, axis=1), 1e-9))[:, None]
    # thin parts may be anywhere
    chosen = np.unique(np.square(modes[:SOFTEST]).reshape(-1, len(rest), 3).sum(axis=2).argmax(axis=1))
    for part in np.array_split(random.permutation(DRAWS), PARTS):
        shapes = (amplitudes[part].astype(np.float32) @ modes).reshape(len(part), -1, 3) + rest
        away = np.einsum("dni,di->dn", shapes, directions[part])
        missing = away.max(axis=1) - away[:, chosen].max(axis=1, initial=-np.inf) > CLOSE
        chosen = np.unique(np.concatenate([chosen, away[missing].argmax(axis=1)]))
    return chosen
