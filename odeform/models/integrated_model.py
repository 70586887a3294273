"""Reduced models whose motion is the solution of an ODE."""

from abc import abstractmethod

from odeform.checkpoint import Checkpoint
from odeform.models.frontier import FrontierPoint
from odeform.models.latent.inference import Decoder
from odeform.models.reduced_model import ReducedModel
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.reduced_motion import Trajectory
from odeform.solver.integrate import SolverSettings
from odeform.solver.method import Field
from odeform.types import Floats

__all__ = ["IntegratedModel"]


class IntegratedModel(ReducedModel):
    """A reduced model with an initial value problem, whose solver can be chosen."""

    def _read(self, checkpoint: Checkpoint) -> None:
        super()._read(checkpoint)
        config = checkpoint.config
        self.qualities = {name: SolverSettings(**values) for name, values in config["qualities"].items()}
        self.frontier = tuple(FrontierPoint.from_json(row) for row in config.get("frontier", ()))

    @abstractmethod
    def problem(self, theta: Floats, evaluated: EvaluatedBasis, dtype: type) -> tuple[Field, Floats, Decoder]:
        """The initial value problem for theta (P,) in [-1, 1]: the field dz/dt = f(t, z), the state at its time 0, and
        the decoder of states."""

    @abstractmethod
    def integrate(self, theta: Floats, evaluated: EvaluatedBasis, quality: SolverSettings, until: float) -> Trajectory:
        """What is solved for theta (P,) in [-1, 1], to `until` seconds."""
