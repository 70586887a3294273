"""A body that is clamped and let go: mechanics of one body, of which nothing is learned, as a model of the page."""

import time
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
import trimesh
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline

from odeform.checkpoint import Checkpoint
from odeform.errors import InputError
from odeform.geometry.solids.tetrahedra import boundary, outward
from odeform.loads.registry import CLAMPED
from odeform.mechanics.clamped import ClampedBody, Weight
from odeform.mechanics.quadratic import Stiffness, quadratic_mesh
from odeform.mechanics.swinging import Loss, SwingingBody, swinging_body
from odeform.models.authors.motion import FrameMotion
from odeform.models.base import Predictor
from odeform.motion.base import SolveStats
from odeform.motion.recent import Recent, geometry_key
from odeform.schema import Parameter, Parameters, Schema, Window
from odeform.solver.integrate import SolverSettings
from odeform.surroundings import Surroundings
from odeform.types import Floats, GaussianSplats, Geometry, Ints, MotionSequence, Points, Times, Vector

__all__ = ["ClampedModel", "Markers", "clamped_checkpoint"]

STEP = 2e-3  # s; half of it changes the motion of the beam by 0.006 mm
FRAMES = 200.0  # Hz, at which points are computed; cubic in between
NEAR = 0.02  # m around the body, within which points move with it: markers are glued on
KEPT = 4  # shapes, and weights, of which what was computed is kept
KPA, GRAM, MS = 1e3, 1e-3, 1e-3

Markers = Mapping[str, Mapping[str, tuple[float, float, float]]]
"""Names and places in m of the markers of a recording, in the axes of the body: on its "tip", and on its "base"."""

PARAMETERS = (
    Parameter("young", "kPa", 150.0, 450.0, 263.8, "log", "body", "Young's modulus"),
    Parameter("viscous", "ms", 0.0, 10.0, 2.0, description="viscous damping, relative to the stiffness"),
    Parameter("lag", "", 0.0, 0.6, 0.0, description="stiffness that relaxes in 20 ms, relative to the static one"),
    Parameter("weight", "g", 0.0, 80.0, 0.0, description="mass that is glued on"),
)
NOTES = (
    "The body is held straight, without stress, and let go at time 0. Its clamped face never moves.",
    "Nothing is learned: ranges are those of the sliders.",
)


def clamped_checkpoint(
    corners: Points,
    elements: Ints,
    held: Bool[np.ndarray, " nodes"],
    material: tuple[float, float],
    gravity: Vector,
    edge: Float[np.ndarray, "places 3"],
    markers: Markers,
    until: float,
) -> Checkpoint:
    """The checkpoint of a clamped body.

    Args:
        corners: (C, 3) m, in the scene's axes, without stress.
        elements: (M, 4) tetrahedra between them.
        held: (N,) the nodes of `quadratic_mesh(corners, elements)` that never move.
        material: Poisson's ratio, and density in kg/m^3.
        gravity: (3,) m/s^2; it need not point along -z.
        edge: (P, 3) m: places over which a weight is spread.
        markers: Where those of a recording are.
        until: The window ends here, s.
    """
    shown = trimesh.Trimesh(corners, boundary(outward(corners, elements))).subdivide()  # so that its bending is seen
    schema = Schema(CLAMPED, PARAMETERS, Window(0.0, until, 100.0), notes=NOTES, surroundings=Surroundings(None))
    arrays = {
        "corners": np.asarray(corners, dtype=float),
        "elements": np.asarray(elements, dtype=np.int32),
        "held": np.asarray(held, dtype=np.uint8),
        "edge": np.asarray(edge, dtype=float),
        "rest.points": np.asarray(shown.vertices, dtype=np.float32),
        "rest.faces": np.asarray(shown.faces, dtype=np.int32),
    }
    plain = {part: {name: list(place) for name, place in places.items()} for part, places in markers.items()}
    poisson, density = material
    config = {"poisson": poisson, "density": density, "gravity": list(map(float, gravity)), "markers": plain}
    return Checkpoint(ClampedModel.model, schema, config, arrays)


class ClampedModel(Predictor):
    """Moves a clamped body that is let go, in some 26 directions, and what is within 20 mm of it."""

    model = "clamped"
    made_of = "mechanics of a clamped body, with the elasticity of large turns; nothing is learned"
    rescales_input = False
    extrapolates = False

    def _read(self, checkpoint: Checkpoint) -> None:
        config, arrays = checkpoint.config, checkpoint.arrays
        self.markers: Markers = {
            part: {name: (float(x), float(y), float(z)) for name, (x, y, z) in places.items()}
            for part, places in config["markers"].items()
        }
        mesh = quadratic_mesh(arrays["corners"], arrays["elements"])
        self._stiffness = Stiffness(mesh, 1e3 * self._default("young"), config["poisson"])
        held, gravity = arrays["held"].astype(bool), np.array(config["gravity"], dtype=float)
        self._body = ClampedBody(self._stiffness, config["density"], held, gravity)
        self._edge = np.asarray(arrays["edge"], dtype=float)
        self._rows: Recent[tuple[Geometry, Any]] = Recent(KEPT)
        self._weighted = lru_cache(KEPT)(self._with_weight)

    def _default(self, name: str) -> float:
        return next(p.default for p in self.schema.parameters if p.name == name)

    def _with_weight(self, grams: float) -> tuple[SwingingBody, Float[np.ndarray, "directions nodes 3"]]:
        """The body in few directions under a weight in g, and these; it takes a second, so the last few are kept."""
        weights = [Weight(GRAM * grams, self._edge)] if grams else []
        body = ClampedBody(self._stiffness, self._body.density, self._body.held, self._body.gravity, weights)
        directions = body.directions()
        return swinging_body(body, directions), directions

    def _solve(
        self,
        geometry: Geometry,
        parameters: Parameters,
        settings: SolverSettings | None,
        until: float,
        observed: MotionSequence | None,
    ) -> FrameMotion:
        if isinstance(geometry, GaussianSplats):
            raise InputError("clamped: cannot deform splats; expected a mesh or points")
        begin, rows = time.perf_counter(), self._rows_at(geometry)
        count = round(max(until, self.schema.window.stop) * FRAMES)
        times = np.arange(count + 1) / FRAMES
        amplitudes = self._amplitudes(parameters, times, STEP)
        seen = np.stack([rows @ one for one in self._weighted(parameters["weight"])[1]])

        def estimate() -> float:
            finer = self._amplitudes(parameters, times, 0.5 * STEP)
            return 1e3 * float(np.sqrt((np.einsum("tr,rpi->tpi", finer - amplitudes, seen) ** 2).mean()))

        steps, wall_ms = round(times[-1] / STEP), 1e3 * (time.perf_counter() - begin)
        stats = SolveStats(f"implicit midpoint, {1e3 * STEP:g} ms", steps, steps, 0, "ok", wall_ms, estimate)
        moved = np.einsum("tr,rpi->tpi", amplitudes, seen)
        centre = moved.mean(axis=1)
        return FrameMotion(self.schema, parameters, geometry, times, centre, moved - centre[:, None], stats)

    def _amplitudes(self, parameters: Parameters, times: Times, step: float) -> Floats:
        """(T, R) at `times` (T,) s, of the body that is let go straight; `InputError` where it cannot be followed."""
        body = self._weighted(parameters["weight"])[0].times_as_stiff(parameters["young"] * KPA / self._stiffness.young)
        loss = Loss(viscous=MS * parameters["viscous"], lag=parameters["lag"])
        swing = body.release(float(times[-1]) + step, step, loss)
        return CubicSpline(swing.times, swing.amplitudes)(times)

    def _rows_at(self, geometry: Geometry) -> Any:
        """(P, N) weights of the nodes at the points of a shape; `InputError` for one that is not at the body."""
        points = np.asarray(geometry.points, dtype=float)
        low, high = (end(self.rest.points, axis=0) for end in (np.min, np.max))
        away = float(np.maximum(np.maximum(low - points, points - high), 0.0).max())
        if not away <= NEAR:
            raise InputError(f"clamped: expected points within {1e3 * NEAR:g} mm of the body, got {1e3 * away:.0f} mm")
        key = geometry_key(geometry)
        return self._rows.get(key, lambda: (geometry, self._stiffness.mesh.rows_at(points)))[1]
