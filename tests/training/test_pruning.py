"""Modes that a model does not know well enough to need are left out once it is trained."""

from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from odeform.dataset.store import open_dataset
from odeform.dataset.training_data import TrainingData, prepare
from odeform.models.latent.model import LatentModel
from odeform.models.registry import load
from odeform.models.training import pruning
from odeform.models.training.pruning import FINE, LARGE, needed_modes, without_modes
from odeform.motion.reduced_space import POSE
from odeform.types import Floats


@pytest.fixture(scope="module")
def model() -> LatentModel:
    return cast(LatentModel, load("mass-elastic"))


@pytest.fixture(scope="module")
def data(model: LatentModel) -> TrainingData:
    whole = prepare(open_dataset("mass-elastic"), modes=model.space.basis.modes)
    few = {name: {**(of := getattr(whole, name)), "val": of["val"][:4]} for name in ("theta", "reduced", "observed")}
    return replace(whole, **few)


def _motions(model: LatentModel, data: TrainingData) -> Floats:
    evaluated = model.evaluate_basis(model.rest, 0.0)
    solved = (model.integrate(theta, evaluated, FINE, float(data.times[-1])) for theta in data.theta["val"])
    return np.stack([motion.reduced(data.times) for motion in solved])


@pytest.mark.parametrize("worse", [1.0, 1.01, 1.2, 10.0])
def test_as_few_as_miss_hardly_more(
    model: LatentModel, data: TrainingData, worse: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pruning, "WORSE", worse)
    motions, truth = _motions(model, data), data.reduced["val"]
    count, modes = needed_modes(model, data), data.space.basis.modes

    deformed = np.linalg.norm(truth[..., POSE:], axis=2)
    large = deformed > LARGE * deformed.max(axis=1)[:, None]

    def missed(first: int) -> float:
        kept = np.concatenate([motions[..., : POSE + first], np.zeros((*truth.shape[:2], modes - first))], axis=-1)
        return float(np.linalg.norm((kept - truth)[large][:, POSE:]))

    assert missed(count) <= worse * missed(modes) * (1.0 + 1e-12)
    assert count == 1 or missed(count - 1) > worse * missed(modes)
    assert worse < 1.2 or count < modes


def test_what_is_left_moves_as_before(model: LatentModel, data: TrainingData, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pruning, "needed_modes", lambda *_: 3)
    bare = {k: v for k, v in model.checkpoint.arrays.items() if not k.startswith("continuation.")}
    checkpoint, fewer = without_modes(replace(model.checkpoint, arrays=bare), data)
    pruned = LatentModel(checkpoint)
    assert pruned.space.basis.modes == fewer.space.basis.modes == pruned.config.modes == 3
    assert fewer.reduced["train"].shape[-1] == POSE + 3
    assert np.allclose(_motions(pruned, fewer), _motions(model, data)[..., : POSE + 3], rtol=0.0, atol=1e-12)
    points = model.rest.points[:5] - model.space.anchor
    kept = model.space.basis.values(points)[..., :3]
    steps = pruned.space.basis.steps  # files keep each mode in steps of its own
    assert steps is not None
    assert (np.abs(pruned.space.basis.values(points) - kept) < steps).all()
    assert sum(a.size for a in checkpoint.arrays.values()) < sum(a.size for a in bare.values())
