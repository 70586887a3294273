"""Classical baselines that were stored in full are stored in steps, and predict the same."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odeform.arrays import STEP
from odeform.checkpoint import Checkpoint, write_checkpoint
from odeform.errors import InputError
from odeform.models.baselines.gp import GaussianProcess
from odeform.models.reduced_model import ReducedModel
from odeform.models.registry import load_model, open_checkpoint
from odeform_figures.storage import is_stored_in_full, stored_in_steps


def in_full(name: str) -> Checkpoint:
    """A bundled checkpoint as it was stored before: with weights, and without steps."""
    checkpoint = open_checkpoint(name)
    model = load_model(checkpoint)
    assert isinstance(model, ReducedModel)
    arrays = {k: v for k, v in checkpoint.arrays.items() if not k.endswith(STEP) and k != "basis.values"}
    arrays["basis.weights"] = model.space.basis.weights
    if isinstance(model, GaussianProcess):
        del arrays["pod.coefficients"]
        arrays["gp.weights"] = model._regression.weights
    return replace(checkpoint, arrays=arrays)


@pytest.mark.parametrize("name", ["mass-elastic/gp", "mass-elastic/nearest", "mass-elastic/pod-rbf", "kick/gp"])
def test_the_same_motions_in_fewer_bytes(name: str, tmp_path: Path) -> None:
    full = in_full(name)
    stored = stored_in_steps(full)
    assert is_stored_in_full(full)
    assert not is_stored_in_full(stored)
    sizes = []
    for index, checkpoint in enumerate((full, stored)):
        write_checkpoint(tmp_path / f"{index}.safetensors", checkpoint)
        sizes.append((tmp_path / f"{index}.safetensors").stat().st_size)
    assert sizes[1] < 0.5 * sizes[0]
    times = np.linspace(0.0, 1.0, 9)
    error = load_model(stored).solve().vertices(times) - load_model(full).solve().vertices(times)
    assert np.sqrt((error**2).mean()) < 5e-6


@pytest.mark.parametrize("name", ["mass-elastic/odeform", "mass-elastic/direct", "contact-force/gp", "kick/gp"])
def test_others_are_refused(name: str) -> None:
    with pytest.raises(InputError, match="stored in full"):
        stored_in_steps(open_checkpoint(name))
