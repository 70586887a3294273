"""The one protocol behind which all models stand, and how one is loaded."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from odeform.checkpoint import Checkpoint, read_checkpoint, resolve_checkpoint
from odeform.errors import InputError
from odeform.models.authors.file import ENDING, read_authors_checkpoint
from odeform.models.frontier import FrontierPoint
from odeform.models.reduced_model import ReducedModel
from odeform.motion.base import Motion
from odeform.schema import Parameters, Schema
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Geometry, Mesh, MotionSequence, Times

__all__ = ["Predictor", "load", "load_continuous", "load_reduced", "observations", "open_checkpoint"]


@runtime_checkable
class Predictor(Protocol):
    """Parameters and a shape in, a motion out."""

    schema: Schema
    checkpoint: Checkpoint
    rest: Mesh
    """The body as viewers show it, where it lies at rest."""
    rescales_input: bool
    """Whether foreign shapes are brought to the size and place of `rest`, or else taken as they are, in metres."""

    extrapolates: bool
    """Whether motions go on beyond the trained window; else it alone can be scored."""

    @property
    def model(self) -> str: ...

    @property
    def qualities(self) -> Mapping[str, SolverSettings]: ...

    def error_band(self, parameters: Parameters, times: Times) -> Floats | None: ...
    @property
    def frontier(self) -> tuple[FrontierPoint, ...]: ...

    def to_body_frame(self, geometry: Geometry, parameters: Mapping[str, Any]) -> Geometry:
        """A body that lies in the scene at rest under `parameters`, in the frame in which `solve` expects it."""
        ...

    def solve(
        self,
        geometry: Geometry | None = None,
        parameters: Mapping[str, Any] | None = None,
        quality: str | SolverSettings = "balanced",
        until: float | None = None,
        observed: MotionSequence | None = None,
    ) -> Motion: ...


def open_checkpoint(name: str | Path) -> Checkpoint:
    """By path, ours or a `.pth` of the authors, or by a bundled one's name (SCENE or SCENE/MODEL)."""
    path = resolve_checkpoint(str(name))
    if path.suffix.lower() == ENDING:
        return read_authors_checkpoint(path)
    return read_checkpoint(path)


def load(name: str | Path) -> Predictor:
    """A predictor from a checkpoint's path, or a bundled one's name (SCENE or SCENE/MODEL)."""
    from odeform.models.authors.predictor import AuthorsModel
    from odeform.models.baselines.direct import Direct
    from odeform.models.baselines.nearest import Nearest
    from odeform.models.baselines.node import Node
    from odeform.models.baselines.occupancy_flow import OccupancyFlow
    from odeform.models.baselines.odeform_per_point import OdeformPerPoint
    from odeform.models.baselines.pod_rbf import PodRbf
    from odeform.models.baselines.rnn import Rnn
    from odeform.models.odeform.model import ODeform

    checkpoint = open_checkpoint(name)
    kinds = (ODeform, OdeformPerPoint, Node, Rnn, Direct, OccupancyFlow, PodRbf, Nearest, AuthorsModel)
    models = {model.model: model for model in kinds}
    if checkpoint.model not in models:
        raise InputError(f"checkpoint {name}: unknown model {checkpoint.model!r}; expected one of {', '.join(models)}")
    return models[checkpoint.model](checkpoint)


def load_continuous(name: str | Path) -> Predictor:
    """As `load`; `InputError` for a network that is tied to the frames it was trained on."""
    predictor = load(name)
    if not predictor.extrapolates:
        raise InputError(f"checkpoint {name}: tied to its trained frames, nothing to measure off them; expected ours")
    return predictor


def load_reduced(name: str | Path) -> ReducedModel:
    """As `load`; `InputError` for a model that moves each point by itself."""
    predictor = load(name)
    if not isinstance(predictor, ReducedModel):
        raise InputError(f"checkpoint {name}: expected a model of reduced motions, got {predictor.model}")
    return predictor


def observations(schema: Schema, record: MotionSequence) -> MotionSequence | None:
    """What a model of this schema is given of a record: the frames of its window's rate; None for most models."""
    if not schema.needs_observations:
        return None
    step = float(record.times[1] - record.times[0])
    return record.until(schema.window.stop, max(round(1.0 / (schema.window.rate * step)), 1))
