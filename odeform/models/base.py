"""The base class of all models: parameters and a shape in, a motion out."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from odeform.checkpoint import Checkpoint, arrays_of_object, write_checkpoint
from odeform.errors import InputError
from odeform.geometry.contact import SurfacePoint
from odeform.geometry.upright import stand_up
from odeform.loads.load import Load
from odeform.loads.registry import PUSH, get_load, known_loads
from odeform.models.batch_parameters import parameter_sets
from odeform.models.error_band import error_band
from odeform.models.frontier import FrontierPoint
from odeform.models.rest import rest_from
from odeform.models.solve import solved, solved_batch
from odeform.motion.base import Motion
from odeform.motion.limits import DEPTH, Limits
from odeform.motion.motion_batch import MotionBatch
from odeform.motion.recent import Recent
from odeform.motion.validity import Validity
from odeform.schema import OBJECT, SHOWN, Parameters
from odeform.simulation.contacts import CONTACT, FORCE, complete_push, vector_of, weaker
from odeform.simulation.scenes.registry import surroundings_of
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Geometry, Mesh, MotionSequence, Times

if TYPE_CHECKING:
    import torch

    from odeform.models.training.run import Run

__all__ = ["QUALITIES", "Predictor", "check_finite"]

QUALITIES = ("draft", "balanced", "reference")
"""The names of solver settings, from cheap to fine; models that do not integrate accept them as well."""

SIZES = 8  # motions whose size is kept
DEEPER = 1.25  # times the depth below the floor of trained motions, where that is more than other bodies may have


def check_finite(geometry: Geometry) -> None:
    """`InputError` for a shape without points, or with points that are not finite."""
    if not np.isfinite(geometry.points).all() or len(geometry.points) == 0:
        raise InputError("geometry: expected at least one point, all finite")


class Predictor(ABC):
    """A trained model of one scene. `odeform.load` returns one.

    Attributes:
        checkpoint: The file it was read from: provenance, scores, SHA-256.
        schema: Its parameters and window of time.
        surroundings: Floor, gravity and contacts of its scene; None where they are not known.
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
    made_of: str = ""
    """Says in words what the model has of neural networks, of mechanics and of regression."""
    qualities: Mapping[str, SolverSettings] = {}
    """Solver settings by name (draft, balanced, reference); empty for models that do not integrate."""
    frontier: tuple[FrontierPoint, ...] = ()
    """The measured solver settings, cheap to fine; empty for models without, and in older checkpoints."""
    accurate: SolverSettings = SolverSettings("dopri5", tolerance=1e-9, dtype="float64")
    """Settings whose errors are far below those of single precision: what derivatives are taken of."""
    rescales_input: bool = True
    """Whether an untrained shape is moved and scaled to fit `rest`; otherwise it is taken as it is, in metres."""
    knows_untrained_errors: bool = False
    """Whether `error_band` holds for shapes that were not trained."""
    extrapolates: bool = True
    """Whether motions continue beyond the trained window; otherwise only the window can be scored."""
    final_only: bool = False
    """Whether only the state at the end of the window is predicted; nothing else is scored then."""

    takes_loads: bool = False
    """Whether it computes its bodies under any load of `odeform.loads`."""
    unloaded: "Predictor | None" = None
    """The model as it was trained, of one under another load."""
    knows_objects: bool = False
    """Whether one training covers all objects of a scene; otherwise there is one for each object."""
    closed_form: bool = False
    """Whether it is solved for, so that a training has no budget."""
    resumable: bool = False
    """Whether an interrupted training can be continued."""
    descends: bool = False
    """Whether it is trained by gradient descent, with a loss and on a device that can be chosen."""
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
            self.surroundings = surroundings_of(checkpoint.schema)
            self.rest = rest_from(checkpoint.arrays)
            objects = {name: arrays_of_object(checkpoint.arrays, name) for name in self.schema.objects}
            self._rests = {name: rest_from(arrays) for name, arrays in objects.items() if "rest.points" in arrays}
            bodies = {"": checkpoint.arrays, **objects}
            bands = {name: error_band(arrays) for name, arrays in bodies.items()}
            self._bands = {name: band for name, band in bands.items() if band is not None}
            with np.errstate(under="ignore"):  # rounding to zero is no error, whatever a program asks numpy for
                self._read(checkpoint)
        except Exception as error:
            # what a damaged file has in the place of a number or a shape may raise anything; in a class of another
            # package, only what `_read` is documented to raise says that the file is at fault
            if not (self._is_of_odeform or isinstance(error, KeyError | ValueError)):
                raise
            raise InputError(f"checkpoint of {checkpoint.model}: missing or wrong {error}") from error

    @property
    def _is_of_odeform(self) -> bool:
        """Whether the class that reads the arrays is one of this package, and not one that a program registered."""
        return type(self).__module__.partition(".")[0] == "odeform"

    def __reduce__(self) -> tuple[Any, ...]:
        """Predictors are pickled as their checkpoints, without what they keep."""
        return type(self), (self.checkpoint,)

    def __copy__(self) -> Any:
        """A shallow copy shares everything that was read."""
        out = object.__new__(type(self))
        vars(out).update(vars(self))
        vars(out).pop("_sizes", None)  # the copy may move otherwise
        return out

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
        """Solves what `solve` is asked for, with all parameters, the settings (None for a model without qualities that
        was given a quality by name), and the end in seconds, soft-clamped to what models are asked for."""

    def solve(
        self,
        geometry: Geometry | None = None,
        parameters: Mapping[str, Any] | None = None,
        quality: str | SolverSettings = "balanced",
        until: float | None = None,
        observed: MotionSequence | None = None,
    ) -> Motion:
        """Solves the motion of `geometry` under `parameters`.

        Args:
            geometry: a shape of N points in metres, where it lies at rest in the scene; by default the trained body
                (`rest_of`). One that was read from a file whose format says that y is up is turned: the scene's z is.
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
        shape = self.settled(complete) if geometry is None else stand_up(geometry)
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
            quality: as of `solve`, for all motions.
            until: as of `solve`.
            geometry: as of `solve`.

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
        shape = self.settled(sets[0]) if geometry is None else stand_up(geometry)
        return solved_batch(self, shape, sets, self._settings(quality, sets[0]), self._end(until))

    def _solve_batch(
        self, geometry: Geometry, sets: list[dict[str, Any]], settings: SolverSettings | None, until: float
    ) -> MotionBatch:
        """Motions that are solved one by one; models that can solve many at once do."""
        return MotionBatch(sets, lambda index: solved(self, geometry, sets[index], settings, until))

    def torch(
        self, parameters: Mapping[str, Any], times: Any, geometry: "Geometry | torch.Tensor | None" = None
    ) -> "torch.Tensor":
        """Predict points as a tensor of PyTorch that can be differentiated, once.

        Args:
            parameters: by name, as `solve` takes them; numbers, or tensors of one number (three for a vector), by which
                the result can be differentiated. Defaults for the others.
            times: (T,) seconds, or one number.
            geometry: points at rest (N, 3) in metres as a tensor, by which the result can be differentiated, or a
                shape as `solve` takes it; by default the trained body.

        Returns:
            (T, N, 3) metres, or (N, 3) for one time, with the precision and the device of the given tensors. The ODE is
            solved by `accurate` settings in double precision. Derivatives of latent models are exact within the window;
            others come from central differences of such solutions, with two of them for each parameter.

        Raises:
            InputError: as `solve`; times that ask for a gradient; and models that interpolate between frames.

        Examples:
            >>> import odeform, torch
            >>> force = torch.tensor(120.0, dtype=torch.float64, requires_grad=True)
            >>> points = odeform.load("kick/gp").torch({"force": force}, [0.1, 0.2])
            >>> points[-1, :, 0].mean().backward()
            >>> bool(force.grad > 0.0)
            True
        """
        from odeform.models.differentiable import differentiable_points

        return differentiable_points(self, parameters, times, geometry)

    def complete(self, parameters: Mapping[str, Any] | None) -> dict[str, Any]:
        """Returns all parameters, checked, with defaults for those not given (`Schema.complete`).

        In a scene in which a sphere pushes bodies, contacts and forces that are not given suit the object: see
        `odeform.simulation.contacts.complete_push`.

        Raises `InputError` for unknown names, and values that are not acceptable.
        """
        given = self.schema.expanded(parameters)
        if self.schema.objects:
            body = {OBJECT: self.schema.check_object(given.get(OBJECT, self.schema.objects[0]))}
            if self.surroundings is not None and self.surroundings.contacts is not None:
                given = complete_push({**body, **given}, self.rest_of(body), partial(self._forces_there, body))
            given = {**self.model_of(body).own_values, **given}
        return self.schema.complete(given)

    @property
    def own_values(self) -> dict[str, float]:
        """Returns what a body has of the scene's parameters where they are not given, in a scene with several
        bodies."""
        return {}

    def force_range(self, parameters: Mapping[str, Any]) -> tuple[float, float]:
        """Returns the weakest and strongest force in newton on the body that `parameters` select, in training.

        A body of the user's own has smaller ones at contacts where it is thin; without a contact, the most anywhere.
        Raises `InputError` in scenes in which no sphere pushes.
        """
        if self.surroundings is None or self.surroundings.contacts is None:
            raise InputError(f"scene {self.schema.scene}: no sphere pushes its bodies")
        return self.surroundings.contacts.forces_on(str(parameters.get(OBJECT, "")))

    def _forces_there(self, body: Mapping[str, Any], contact: SurfacePoint) -> tuple[float, float]:
        named = {f"{CONTACT}_{axis}": float(x) for axis, x in zip("xyz", contact.point, strict=True)}
        return self.force_range({**body, **named})

    def rest_of(self, parameters: Mapping[str, Any]) -> Mesh:
        """The trained body at rest that `parameters` select in a scene with objects; `rest` in all other scenes."""
        return self._rests.get(parameters.get(OBJECT, ""), self.rest)

    def is_changed(self, parameters: Mapping[str, Any]) -> bool:
        """Whether the body has another mass or stiffness than its own, to three digits; no error is known there."""
        return any(not np.isclose(parameters.get(name, own), own, rtol=SHOWN) for name, own in self.own_values.items())

    def settled(self, parameters: Mapping[str, Any]) -> Mesh:
        """The body where it rests under these parameters: where motions start. Contacts are places on `rest_of`, and
        move with its surface."""
        return self.rest_of(parameters)

    def shown(self, geometry: Geometry) -> Any:
        """The shape whose points its motions have, from the one that is given to `solve`: two like it, where a body
        meets a twin of itself."""
        return geometry

    def error_band(
        self, parameters: Parameters, times: Times, size: Callable[[], float] | None = None
    ) -> Floats | None:
        """(T, 2) RMSE in mm at (T,) seconds that half, and nine in ten, of unseen motions of the trained body stay
        within.

        `size` tells `Motion.size_mm` of the motion; without it, a band that follows it solves the motion. None where
        the checkpoint holds errors of too few validation sequences for that, and for a body of another mass or
        stiffness than its own.
        """
        if self.model_of(parameters).is_changed(parameters):
            return None
        band = self._bands.get(parameters.get(OBJECT, ""), self._bands.get(""))
        if band is None:
            return None
        stronger, moved = self.stronger(parameters), 0.0
        if band.follows_size:
            # beyond the strongest push, the band is that of this one, and grows with how much stronger it is
            moved = size() if size and not stronger else self.size_mm(weaker(parameters, 1.0 + 0.5 * stronger))
        return band.at(self.schema.vector(parameters), times, stronger, moved)

    @cached_property
    def _sizes(self) -> Recent[float]:
        return Recent(SIZES)

    def size_mm(self, parameters: Parameters) -> float:
        """`Motion.size_mm` of the trained body; the last few are kept."""
        given = self.complete(parameters)
        return self._sizes.get(tuple(given.items()), lambda: self.solve(None, given).size_mm)

    def stronger(self, parameters: Parameters) -> float:
        """By how much a push is stronger than all in training (`Contacts.stronger`); 0 in scenes without a sphere."""
        if self.surroundings is None or self.surroundings.contacts is None:
            return 0.0
        strength = float(np.linalg.norm(vector_of(parameters, FORCE)))
        return self.surroundings.contacts.stronger(str(parameters.get(OBJECT, "")), strength)

    def band_motions(self, parameters: Parameters) -> int:
        """On how many whole motions the error band of a body was calibrated, none of which chose the model: nine in ten
        motions then stay within it throughout. 0 where it holds for each moment by itself, or is not known."""
        band = self._bands.get(parameters.get(OBJECT, ""), self._bands.get(""))
        return 0 if band is None else band.motions

    @property
    def loads(self) -> tuple[str, ...]:
        """Names of the loads under which it computes its bodies; empty for models that know one scene only."""
        return known_loads() if self.takes_loads else ()

    def under(self, load: str) -> "Predictor":
        """The model of the same bodies under another load, such as "drop", "throw" or "kick".

        Nothing of it is learned from motions under that load but what its contacts with the floor are like.

        Raises:
            InputError: An unknown load, or a model that knows the motions of its training data only.

        Examples:
            >>> import odeform
            >>> drop = odeform.load("contact-force").under("drop")
            >>> motion = drop.solve(parameters={"object": "donut", "height": 0.2, "turn_x": 90.0})
            >>> round(float(motion.vertices(0.0)[:, 2].min()), 3)
            0.2
        """
        root = self.unloaded or self
        if load == PUSH:
            return root
        found = root.of_same_kind(root.under_load(root.checkpoint, get_load(load)))
        found.unloaded = root
        return found

    @classmethod
    def under_load(cls, checkpoint: Checkpoint, load: Load) -> Checkpoint:
        """The checkpoint of the same bodies in the scene of a load; `InputError` where that cannot be."""
        raise InputError(
            f"load {load.name!r}: {cls.model} knows the motions of its training data only; expected a mechanical model"
        )

    def of_same_kind(self, checkpoint: Checkpoint) -> "Predictor":
        """Reads another checkpoint as this one was read."""
        return type(self)(checkpoint)

    def save(self, path: str | Path) -> None:
        """Write the checkpoint, which `odeform.load` reads."""
        write_checkpoint(path, self.checkpoint)

    @property
    def bodies(self) -> tuple[Mesh, ...]:
        """The trained bodies where they rest in the scene; empty where the checkpoint does not hold them."""
        return tuple(self._rests.values()) or (self.rest,)

    @cached_property
    def validity(self) -> Validity:
        """The trained bodies, and the limits of motions in the scene. Nothing is known of an imported scene."""
        validity = Validity(self.bodies, error_band=self.error_band, knows_untrained_errors=self.knows_untrained_errors)
        around = self.surroundings
        if around is None:
            return replace(validity, limits=Limits(energy=np.inf))
        trained = self.checkpoint.arrays.get("trained.depth_m", np.zeros(1))
        limits = Limits(around.floor, max(DEPTH, DEEPER * float(trained.max())), around.gravity)
        if limits.floor is not None and self.rest.points[:, 2].min() < limits.floor - limits.depth:
            limits = Limits(None, gravity=around.gravity)
        return replace(validity, limits=limits)

    def to_body_frame(self, geometry: Geometry, parameters: Mapping[str, Any]) -> Geometry:
        """A body at rest in the scene, in the frame in which `solve` expects it: here the scene's own."""
        return geometry

    def _check_observed(self, observed: MotionSequence | None) -> None:
        if observed is not None and not self.schema.needs_observations:
            raise InputError(f"{self.model}: predicts from parameters alone and takes no observed frames")
        if observed is None and self.schema.needs_observations:
            raise InputError(f"{self.model}: interpolates between observed frames, and none were given")

    def _end(self, until: float | None) -> float:
        """The seconds up to which to solve, soft-clamped; the trained window for None."""
        window = self.schema.window
        try:
            end = window.stop if until is None else float(until)
        except (TypeError, ValueError):
            end = np.nan
        if np.isnan(end):
            raise InputError(f"until: expected a number of seconds, got {until!r}")
        return float(window.soft_clamped(np.array(end)))

    def model_of(self, parameters: Parameters) -> "Predictor":
        """The model of the body that complete `parameters` select: itself, where there is one for all."""
        return self

    def frontier_of(self, parameters: Parameters) -> tuple[FrontierPoint, ...]:
        """`frontier`, for the body in `parameters`, which are complete."""
        return self.frontier

    def _qualities_of(self, parameters: Parameters) -> Mapping[str, SolverSettings]:
        """`qualities`, for the body in `parameters`."""
        return self.qualities

    def _settings(self, quality: str | SolverSettings, parameters: Parameters) -> SolverSettings | None:
        """None for a model without qualities that is given one by name."""
        if isinstance(quality, SolverSettings):
            return quality
        known = self._qualities_of(parameters)
        if not isinstance(quality, str) or quality not in (known or QUALITIES):
            raise InputError(f"unknown quality {quality!r}: expected one of {', '.join(known or QUALITIES)}")
        return known.get(quality)
