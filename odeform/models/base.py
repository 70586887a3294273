"""The base class of all models: parameters and a shape in, a motion out."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from odeform.checkpoint import Checkpoint, arrays_of_object
from odeform.errors import InputError
from odeform.models.batch_parameters import parameter_sets
from odeform.models.error_band import error_band
from odeform.models.frontier import FrontierPoint
from odeform.motion.base import Motion
from odeform.motion.limits import DEPTH, Limits
from odeform.motion.motion_batch import MotionBatch
from odeform.motion.trust import Trust
from odeform.schema import OBJECT, Parameters
from odeform.simulation.scenes.registry import find_scene
from odeform.solver.integrate import SolverSettings
from odeform.types import Arrays, Floats, Geometry, Mesh, MotionSequence, Times

if TYPE_CHECKING:
    from odeform.models.training.run import Run

__all__ = ["Predictor", "check_finite", "solved"]

DEEPER = 1.25  # times the depth below the floor of trained motions, where that is more than other bodies may have


def check_finite(geometry: Geometry) -> None:
    """`InputError` for a shape without points, or with points that are not finite."""
    if not np.isfinite(geometry.points).all() or len(geometry.points) == 0:
        raise InputError("geometry: expected at least one point, all finite")


def _rest(arrays: Arrays) -> Mesh:
    mesh = Mesh(arrays["rest.points"], arrays["rest.faces"])
    points, faces = mesh.points, mesh.faces
    if points.ndim != 2 or faces.ndim != 2 or points.shape[1:] != (3,) or faces.shape[1:] != (3,) or not len(points):
        raise ValueError(f"body with points {points.shape} and faces {faces.shape}")
    if faces.dtype.kind not in "iu" or faces.min(initial=0) < 0 or faces.max(initial=0) >= len(points):
        raise ValueError("faces of the body, which refer to points that do not exist")
    return mesh


class Predictor(ABC):
    """A trained model of one scene. `odeform.load` returns one.

    Attributes:
        checkpoint: The file it was read from: provenance, scores, SHA-256.
        schema: Its parameters and window of time.
        rest: The trained body at rest, N vertices in metres; that of the default object, if there are several.

    Examples:
        >>> import odeform
        >>> predictor = odeform.load("kick")
        >>> motion = predictor.solve(parameters={"mass": 0.6, "force": 140.0})
        >>> motion.vertices(0.02).shape
        (2306, 3)
        >>> band = predictor.error_band(motion.parameters, predictor.schema.window.times)
        >>> band.shape
        (121, 2)

    A subclass sets `model`, reads its arrays in `_read`, predicts in `_solve`, and is trained by `train`.
    """

    model: str
    """The name under which checkpoints and the command line know this class."""
    qualities: Mapping[str, SolverSettings] = {}
    """Solver settings by name (draft, balanced, reference); empty for models that do not integrate."""
    frontier: tuple[FrontierPoint, ...] = ()
    """The measured solver settings, cheap to fine; empty for models without, and in older checkpoints."""
    rescales_input: bool = True
    """Whether a foreign shape is moved and scaled to fit `rest`; otherwise it is taken as it is, in metres."""
    knows_foreign_errors: bool = False
    """Whether `error_band` holds for shapes that were not trained."""
    extrapolates: bool = True
    """Whether motions continue beyond the trained window; otherwise only the window can be scored."""
    final_only: bool = False
    """Whether only the state at the end of the window is predicted; nothing else is scored then."""

    knows_objects: bool = False
    """Whether one training covers all objects of a scene; otherwise there is one for each object."""
    closed_form: bool = False
    """Whether it is solved for, so that a training has no budget."""
    resumable: bool = False
    """Whether an interrupted training can be continued."""
    ablations: ClassVar[Mapping[str, str]] = {}
    """Parts that a training may leave out, and what that means."""

    @classmethod
    def train(cls, run: "Run") -> Checkpoint:
        """Train on the data of `run`, and return what a checkpoint keeps, without its scores.

        Raises `InputError` for data that the model cannot be trained on; so do models that are only read.
        """
        raise InputError(f"{cls.model}: is only read, and cannot be trained")

    def __init__(self, checkpoint: Checkpoint) -> None:
        try:
            self.checkpoint = checkpoint
            self.schema = checkpoint.schema
            self.rest = _rest(checkpoint.arrays)
            objects = {name: arrays_of_object(checkpoint.arrays, name) for name in self.schema.objects}
            self._rests = {name: _rest(arrays) for name, arrays in objects.items() if "rest.points" in arrays}
            bodies = {"": checkpoint.arrays, **objects}
            bands = {name: error_band(arrays) for name, arrays in bodies.items()}
            self._bands = {name: band for name, band in bands.items() if band is not None}
            self._read(checkpoint)
        except Exception as error:
            # what a damaged file has in the place of a number or a shape may raise anything
            raise InputError(f"checkpoint of {checkpoint.model}: missing or wrong {error}") from None

    def __reduce__(self) -> tuple[Any, ...]:
        """Predictors are pickled as their checkpoints, without what they keep."""
        return type(self), (self.checkpoint,)

    @abstractmethod
    def _read(self, checkpoint: Checkpoint) -> None:
        """Take what this model needs; KeyError or ValueError where it is missing or wrong."""

    @abstractmethod
    def _solve(
        self,
        geometry: Geometry,
        parameters: Parameters,
        settings: SolverSettings | None,
        until: float,
        observed: MotionSequence | None,
    ) -> Motion:
        """As `solve`, with everything filled in: all parameters, the settings (None for a model without qualities
        that was given a quality by name), and the end in seconds, soft-clamped to what models are asked for."""

    def solve(
        self,
        geometry: Geometry | None = None,
        parameters: Mapping[str, Any] | None = None,
        quality: str | SolverSettings = "balanced",
        until: float | None = None,
        observed: MotionSequence | None = None,
    ) -> Motion:
        """The motion of `geometry` under `parameters`.

        Args:
            geometry: a shape of N points in metres, where it lies at rest in the scene; by default the trained body
                (`rest_of`).
            parameters: by name, in the units of `schema`; defaults for the others.
            quality: the name of one of `qualities`, or solver settings.
            until: seconds that are integrated at once (default: the trained window). Later times may be evaluated
                too and continue the integration. Beyond the trained range parameters and times are soft-clipped
                (`Schema.inputs`, `Window.soft_clamped`), so that motions stay bounded.
            observed: the frames between which a model with `schema.needs_observations` interpolates.

        Raises:
            InputError: for a shape, parameter, quality or observation that this model cannot use.
        """
        self._check_observed(observed)
        end = self._end(until)
        complete = self.complete(parameters)
        shape = self.rest_of(complete) if geometry is None else geometry
        return solved(self, shape, complete, self._settings(quality, complete), end, observed)

    def solve_batch(
        self,
        parameters: Mapping[str, Any],
        quality: str | SolverSettings = "balanced",
        until: float | None = None,
        geometry: Geometry | None = None,
    ) -> MotionBatch:
        """The motions of `geometry` under B sets of parameters, each as `solve` has it.

        Args:
            parameters: by name, arrays (B,), or (B, 3) for a vector, in the units of `schema`. A number, vector or name
                is shared by all; defaults for the others.
            quality, until, geometry: as of `solve`, for all motions.

        Raises:
            InputError: for arrays of different lengths or shapes, and what `solve` cannot use.

        Examples:
            >>> import numpy as np
            >>> import odeform
            >>> batch = odeform.load("kick").solve_batch({"mass": np.linspace(0.5, 1.0, 100), "force": 140.0})
            >>> batch.vertices(0.2).shape, batch.pose(np.array([0.1, 0.2])).shape
            ((100, 2306, 3), (100, 2, 4, 4))
        """
        self._check_observed(None)
        sets = parameter_sets(self.schema, parameters, self.complete)
        shape = self.rest_of(sets[0]) if geometry is None else geometry
        return _solved_batch(self, shape, sets, self._settings(quality, sets[0]), self._end(until))

    def _solve_batch(
        self, geometry: Geometry, sets: list[dict[str, Any]], settings: SolverSettings | None, until: float
    ) -> MotionBatch:
        """Motions that are solved one by one; models that can solve many at once do."""
        return MotionBatch(sets, lambda index: solved(self, geometry, sets[index], settings, until))

    def _end(self, until: float | None) -> float:
        window = self.schema.window
        return float(window.soft_clamped(np.array(window.stop if until is None else until)))

    def complete(self, parameters: Mapping[str, Any] | None) -> dict[str, Any]:
        """All parameters, checked, with defaults for those not given (`Schema.complete`).

        In a scene in which a sphere pushes bodies, contacts and forces that are not given suit the object: see
        `Contacts.complete`. Raises `InputError` for unknown names, and values that are not acceptable.
        """
        given = self.schema.expanded(parameters)
        scene = find_scene(self.schema.scene) if self.schema.objects else None
        if scene is not None and scene.contacts is not None:
            name = self.schema.check_object(given.get(OBJECT, self.schema.objects[0]))
            body = {OBJECT: name}
            given = scene.contacts.complete({**body, **given}, self.rest_of(body), self.force_range(body))
        return self.schema.complete(given)

    def force_range(self, parameters: Mapping[str, Any]) -> tuple[float, float]:
        """Weakest and strongest force in newton on the body that `parameters` select, in training.

        Raises `InputError` in scenes in which no sphere pushes.
        """
        scene = find_scene(self.schema.scene)
        if scene is None or scene.contacts is None:
            raise InputError(f"scene {self.schema.scene}: no sphere pushes its bodies")
        return scene.contacts.forces(str(parameters.get(OBJECT, "")))

    def rest_of(self, parameters: Mapping[str, Any]) -> Mesh:
        """The trained body at rest that `parameters` select in a scene with objects; `rest` in all other scenes."""
        return self._rests.get(parameters.get(OBJECT, ""), self.rest)

    def error_band(self, parameters: Parameters, times: Times) -> Floats | None:
        """(T, 2) RMSE in mm at (T,) seconds that half, and nine in ten, of unseen motions of the trained body stay
        within. None where the checkpoint holds errors of too few validation sequences for that."""
        band = self._bands.get(parameters.get(OBJECT, ""), self._bands.get(""))
        return None if band is None else band.at(self.schema.vector(parameters), times)

    @property
    def bodies(self) -> tuple[Mesh, ...]:
        """The trained bodies where they rest in the scene; empty where the checkpoint does not hold them."""
        return tuple(self._rests.values()) or (self.rest,)

    @cached_property
    def trust(self) -> Trust:
        """The trained bodies, and the limits of motions in the scene. Nothing is known of an imported scene."""
        trust = Trust(self.bodies, error_band=self.error_band, knows_foreign_errors=self.knows_foreign_errors)
        scene = find_scene(self.schema.scene)
        if scene is None:
            return replace(trust, limits=Limits(energy=np.inf))
        trained = self.checkpoint.arrays.get("trained.depth_m", np.zeros(1))
        limits = Limits(scene.floor, max(DEPTH, DEEPER * float(trained.max())), scene.gravity)
        if limits.floor is not None and self.rest.points[:, 2].min() < limits.floor - limits.depth:
            limits = Limits(None, gravity=scene.gravity)
        return replace(trust, limits=limits)

    def to_body_frame(self, geometry: Geometry, parameters: Mapping[str, Any]) -> Geometry:
        """A body at rest in the scene, in the frame in which `solve` expects it: here the scene's own."""
        return geometry

    def _check_observed(self, observed: MotionSequence | None) -> None:
        if observed is not None and not self.schema.needs_observations:
            raise InputError(f"{self.model}: predicts from parameters alone and takes no observed frames")
        if observed is None and self.schema.needs_observations:
            raise InputError(f"{self.model}: interpolates between observed frames, and none were given")

    def frontier_of(self, parameters: Parameters) -> tuple[FrontierPoint, ...]:
        """`frontier`, for the body in `parameters`, which are complete."""
        return self.frontier

    def _qualities_of(self, parameters: Parameters) -> Mapping[str, SolverSettings]:
        """`qualities`, for the body in `parameters`."""
        return self.qualities

    def _settings(self, quality: str | SolverSettings, parameters: Parameters) -> SolverSettings | None:
        """None for a model without qualities that is given one by name."""
        known = self._qualities_of(parameters)
        if not known or isinstance(quality, SolverSettings):
            return quality if isinstance(quality, SolverSettings) else None
        if quality not in known:
            raise InputError(f"unknown quality {quality!r}: expected one of {', '.join(known)}")
        return known[quality]


def solved(
    predictor: Predictor,
    geometry: Geometry,
    parameters: Parameters,
    settings: SolverSettings | None,
    until: float,
    observed: MotionSequence | None = None,
) -> Motion:
    """The motion that `predictor` solves for what `Predictor.solve` fills in; pickled, it is solved again."""
    motion = predictor._solve(geometry, parameters, settings, until, observed)
    given = (predictor, geometry, parameters, settings, until, observed)
    object.__setattr__(motion, "made_by", (solved, given))  # motions are frozen
    return motion


def _solved_batch(
    predictor: Predictor,
    geometry: Geometry,
    sets: list[dict[str, Any]],
    settings: SolverSettings | None,
    until: float,
) -> MotionBatch:
    batch = predictor._solve_batch(geometry, sets, settings, until)
    batch.made_by = _solved_batch, (predictor, geometry, sets, settings, until)
    return batch
