"""The one protocol behind which all models stand, and how one is loaded."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from odeform.checkpoint import Checkpoint, read_checkpoint, resolve_checkpoint
from odeform.errors import InputError
from odeform.model.motion import Motion
from odeform.schema import Parameters, Schema
from odeform.solver.frontier import FrontierPoint
from odeform.solver.integrate import Quality
from odeform.types import Floats, Geometry, Mesh, Times

__all__ = ["Predictor", "load"]


@runtime_checkable
class Predictor(Protocol):
    """Parameters and a shape in, a motion out."""

    schema: Schema
    checkpoint: Checkpoint
    rest: Mesh

    @property
    def model(self) -> str: ...

    @property
    def qualities(self) -> Mapping[str, Quality]: ...

    def expected_error(self, parameters: Parameters, times: Times) -> Floats | None: ...
    @property
    def frontier(self) -> tuple[FrontierPoint, ...]: ...

    def solve(
        self,
        geometry: Geometry | None = None,
        parameters: Mapping[str, Any] | None = None,
        quality: str | Quality = "balanced",
        until: float | None = None,
        observed: None = None,
    ) -> Motion: ...


def load(name: str | Path) -> Predictor:
    """A predictor from a checkpoint's path, or a bundled one's name (SCENE or SCENE/MODEL)."""
    from odeform.baselines.nearest import Nearest
    from odeform.baselines.pod_rbf import PodRbf
    from odeform.model.odeform import ODeform

    checkpoint = read_checkpoint(resolve_checkpoint(str(name)))
    models = {model.model: model for model in (ODeform, PodRbf, Nearest)}
    if checkpoint.model not in models:
        raise InputError(f"checkpoint {name}: unknown model {checkpoint.model!r}; expected one of {', '.join(models)}")
    return models[checkpoint.model](checkpoint)
