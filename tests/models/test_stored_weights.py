"""Weights of networks of points are stored in steps, and predict the same to a fraction of their error."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odeform.checkpoint import write_checkpoint
from odeform.models.points.point_model import PREFIX, weights_in_steps
from odeform.models.registry import load


@pytest.mark.parametrize("name", ["mass-elastic/direct", "mass-elastic/rnn"])
def test_the_same_motions_in_fewer_bytes(name: str, tmp_path: Path) -> None:
    full = load(name)
    weights = {key: array for key, array in full.checkpoint.arrays.items() if key.startswith(PREFIX)}
    stored = replace(full.checkpoint, arrays={**full.checkpoint.arrays, **weights_in_steps(weights)})
    write_checkpoint(tmp_path / "full.safetensors", full.checkpoint)
    write_checkpoint(tmp_path / "stored.safetensors", stored)
    size = sum(4 * array.size for array in weights.values())
    saved = (tmp_path / "full.safetensors").stat().st_size - (tmp_path / "stored.safetensors").stat().st_size
    assert saved > 0.5 * size
    again = load(tmp_path / "stored.safetensors")
    times = np.linspace(0.1, 1.0, 4)
    difference = again.solve().vertices(times) - full.solve().vertices(times)
    assert 0.0 < 1e3 * np.sqrt((difference**2).mean()) < 0.05 * full.checkpoint.scores["rmse_pooled_mm"]
