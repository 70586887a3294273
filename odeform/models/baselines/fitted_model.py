"""Reduced models whose parameters are solved for in closed form, not trained by descent."""

from abc import abstractmethod
from typing import TYPE_CHECKING, Any

from odeform.checkpoint import Checkpoint
from odeform.dataset.training_data import TrainingData
from odeform.models.reduced_model import ReducedModel
from odeform.types import Arrays, Floats

if TYPE_CHECKING:
    from odeform.models.training.run import Run

__all__ = ["FittedModel"]


class FittedModel(ReducedModel):
    """A reduced model with a closed-form fit: `train` calls `fit` and stores what it returns."""

    closed_form = True

    @classmethod
    def train(cls, run: "Run") -> Checkpoint:
        from odeform.models.training.continuation import with_continuation

        data = run.reduced_data(patterns=True)
        return with_continuation(cls(run.reduced_checkpoint(data, *cls.fit(data))), data)

    @staticmethod
    @abstractmethod
    def fit(data: TrainingData) -> tuple[Arrays, dict[str, Any]]:
        """Fits the arrays and settings of the checkpoint, from which `_read` restores the model."""

    def _check_inputs(self, theta: Floats) -> None:
        """Raise `ValueError` unless theta is (S, P), with the scene's P parameters."""
        count = len(self.schema.learned)
        if theta.ndim != 2 or theta.shape[1] != count:
            raise ValueError(f"theta: expected shape (S, {count}), got {theta.shape}")
