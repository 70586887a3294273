"""Reduced models whose parameters are solved for in closed form, not trained by descent."""

from abc import abstractmethod
from typing import Any

from odeform.dataset.training_data import TrainingData
from odeform.models.reduced_model import ReducedModel
from odeform.types import Arrays

__all__ = ["FittedModel"]


class FittedModel(ReducedModel):
    """A reduced model with a closed-form fit: `odeform train` calls `fit` and stores what it returns."""

    @staticmethod
    @abstractmethod
    def fit(data: TrainingData) -> tuple[Arrays, dict[str, Any]]:
        """Arrays and settings of the checkpoint, from which `_read` restores the model."""
