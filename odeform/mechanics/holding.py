"""Springs both ways that hold a patch of a body where it began."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from odeform.loads.situation import Clamp
from odeform.mechanics.body import ReducedBody, spread
from odeform.mechanics.rotations import skew
from odeform.mechanics.state import State
from odeform.mechanics.warping import bent
from odeform.types import Floats, Ints, Points

__all__ = ["Grip", "Held", "Hold", "grip_of", "no_hold"]

HELD = 40  # points of a patch that springs hold
LEAST = 0.02  # of the largest stiffness of a sample, below which it is left out
EACH = {"points": 2, "rows": 2, "stiffness": 1, "places": 1}  # and the axis of their points


@dataclass(frozen=True, eq=False)
class Grip:
    """What of a body's surface is held."""

    samples: Ints
    """(H,) vertices of the body."""
    stiffness: Float[np.ndarray, " held"]
    """(H,) N/m of each, along each axis."""
    loads: Float[np.ndarray, "modes loads"]
    """What forces on the patch, even ones and ones that grow along it, do to the modes of the body."""


def grip_of(body: ReducedBody, clamp: Clamp) -> Grip:
    """The vertices of a body that stand for those that a clamp holds: as stiff as these together against every shift
    and turn of the body."""
    vertices = body.surface.points[: len(body.fractions)]
    every = clamp.stiffness(vertices, body.fractions, body.solid.mass)
    inside = np.flatnonzero(every > LEAST * every.max())
    points = vertices[inside]
    chosen = spread(points, HELD, int(every[inside].argmax()))
    owner = KDTree(points[chosen]).query(points)[1]
    stiffness = np.bincount(owner, every[inside], len(chosen)).astype(float)
    weights = every[inside] / every[inside].sum()
    stiffness = _with_moments(stiffness, points[chosen], every, vertices)
    return Grip(inside[chosen], stiffness, _loads(body, inside, points, weights))


def _with_moments(
    few: Floats, places: Float[np.ndarray, "held 3"], every: Floats, points: Float[np.ndarray, "all 3"]
) -> Floats:
    """Stiffnesses (H,) at `places` (H, 3) m near `few` (H,) whose sum, and first and second moments, are those of
    `every` (N,) at `points` (N, 3) m. Samples stand for what is around them, and by themselves they would turn more
    easily. Where that takes springs that push away, these are left out."""
    middle = every @ points / every.sum()
    size = float(np.ptp(places, axis=0).max()) or 1.0
    wanted = _moments((points - middle) / size).T @ every
    terms = _moments((places - middle) / size)
    # the smallest changes, relative to the stiffness of each
    changes = np.linalg.pinv(terms.T @ (few[:, None] * terms)) @ (wanted - terms.T @ few)
    out = np.maximum(few * (1.0 + terms @ changes), 0.0)
    return out * (every.sum() / out.sum())


def _moments(places: Points) -> Float[np.ndarray, "points terms"]:
    """(N, 10): one, the coordinates, and their products."""
    first, second = np.triu_indices(3)
    return np.column_stack([np.ones(len(places)), places, places[:, first] * places[:, second]])


def _loads(body: ReducedBody, inside: Ints, points: Points, weights: Floats) -> Floats:
    """(M, 9): forces along each axis, even ones and ones that grow along the patch in two directions."""
    arms = points - weights @ points
    along = np.linalg.eigh((weights * arms.T) @ arms)[1].T[1:]  # the two in which it is widest
    grows = np.stack([np.ones(len(points)), *(along @ arms.T)])
    rows = body.surface.rows[:3, inside]  # (3, N, M)
    return np.einsum("gn,anm->mga", weights * grows, rows).reshape(rows.shape[2], -1)


@dataclass(frozen=True, eq=False)
class Hold:
    """Springs and dampers that hold H points of each of B bodies."""

    points: Float[np.ndarray, "batch 3 held"]
    """m at rest, from the mass centre."""
    rows: Float[np.ndarray, "batch 6 held directions"]
    """Displacements there by the directions of deformation, as in `odeform.mechanics.push.Push`."""
    stiffness: Float[np.ndarray, "batch held"]
    """N/m along each axis."""
    places: Float[np.ndarray, "batch held 3"]
    """m in axes of the scene, from where the mass centre rests: where they are held."""
    damping: float
    """s: of the dampers, relative to the springs."""

    @classmethod
    def of(cls, body: ReducedBody, grip: Grip, modes: Floats, damping: float) -> "Hold":
        """One body in directions (M, K) of deformation, held where it is when all its coordinates are zero."""
        samples = grip.samples
        rows = np.stack([row.take(samples, axis=0) @ modes for row in body.surface.rows])
        points = body.surface.points[samples]
        return cls(np.ascontiguousarray(points.T)[None], rows[None], grip.stiffness[None], points[None], damping)

    @classmethod
    def together(cls, holds: Sequence["Hold"]) -> "Hold":
        """Several bodies as a batch. Those with fewer points than others get some of no stiffness."""
        most = max(hold.points.shape[2] for hold in holds)
        each = {
            name: np.concatenate([_padded(getattr(hold, name), axis, most) for hold in holds])
            for name, axis in EACH.items()
        }
        return replace(holds[0], **each)

    def some(self, rows: Ints) -> "Hold":
        """Those of the bodies `rows` (R,)."""
        return replace(self, **{name: getattr(self, name)[rows] for name in EACH})

    def begun(self, state: State) -> "Hold":
        """The same springs, without stress in a state."""
        return replace(self, places=self._places(state))

    def _places(self, state: State) -> Float[np.ndarray, "batch held 3"]:
        _, place = bent(self.points, self.rows, state)
        return (state.rotation @ place).swapaxes(1, 2) + state.shift[:, None]

    def at(self, state: State) -> "Held":
        """The springs, linearised about a state, in axes of the bodies."""
        turning, place = bent(self.points, self.rows, state)
        batch, _, held = place.shape
        out = np.zeros((batch, held, 3, state.velocity.shape[1]))
        out[..., :3] = np.eye(3)
        out[..., 3:6] = skew(-place.swapaxes(1, 2))
        np.matmul(turning.rotations, self.rows[:, :3].swapaxes(1, 2), out=out[..., 6 : state.body])
        away = place.swapaxes(1, 2) - (self.places - state.shift[:, None]) @ state.rotation
        stiffness = np.repeat(self.stiffness, 3, axis=1)
        return Held(out.reshape(batch, 3 * held, -1), away.reshape(batch, -1), stiffness, self.damping)


def _padded(values: Floats, axis: int, count: int) -> Floats:
    """The values with zeros after them along an axis, `count` in all."""
    widths = [(0, count - size if place == axis else 0) for place, size in enumerate(values.shape)]
    return np.pad(values, widths)


def no_hold(batch: int, directions: int) -> Hold:
    """Bodies that nothing holds."""
    rows = np.zeros((batch, 6, 0, directions))
    return Hold(np.zeros((batch, 3, 0)), rows, np.zeros((batch, 0)), np.zeros((batch, 0, 3)), 0.0)


@dataclass(frozen=True, eq=False)
class Held:
    """R springs along axes of B bodies, linearised."""

    jacobian: Float[np.ndarray, "batch rows velocities"]
    """How fast each grows, by the velocities of the body in its own axes."""
    away: Float[np.ndarray, "batch rows"]
    """m, how long it is."""
    stiffness: Float[np.ndarray, "batch rows"]
    """N/m."""
    damping: float

    def resistance(self, step: Float[np.ndarray, "#steps #batch 1"]) -> tuple[Floats, Floats]:
        """Returns what they add to the matrix (H, B, V, V) in kg and to the momentum (H, B, V) of each of H steps."""
        stiff = self.stiffness[..., None] * self.jacobian
        square = self.jacobian.swapaxes(1, 2) @ stiff
        pull = -(self.away[:, None] @ stiff)[:, 0]
        return (step * (step + self.damping))[..., None] * square, step * pull

    def forces(self, velocity: Float[np.ndarray, "batch velocities"]) -> Float[np.ndarray, "batch velocities"]:
        """Returns what they add to the rate of the momentum, at these velocities."""
        speed = (self.jacobian @ velocity[..., None])[..., 0]
        return -((self.stiffness * (self.away + self.damping * speed))[:, None] @ self.jacobian)[:, 0]
