"""The names of models."""

import pytest

from odeform.models.names import MODELS
from odeform.models.registry import model_class


@pytest.mark.parametrize("name", MODELS)
def test_checkpoints_store_the_registered_name(name: str) -> None:
    assert model_class(name).model == name
