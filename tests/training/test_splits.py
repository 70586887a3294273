"""Which sequences a training reads: the test split only when everything is chosen."""

import functools
from dataclasses import replace
from pathlib import Path

import pytest

from odeform.dataset.index import Dataset, Entry
from odeform.models.latent.training import config
from odeform.models.training.body import body_arrays
from odeform.models.training.request import TrainRequest
from odeform.models.training.run import Run, train_model
from odeform.types import MotionSequence


@pytest.mark.parametrize("model", ["odeform", "pod-rbf", "gp", "nearest", "direct"])
def test_the_test_split_is_not_read(
    dataset: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, model: str
) -> None:
    few = functools.partial(config.TrainConfig, random_features=200, sharpnesses=(1.0,))
    monkeypatch.setattr(config, "TrainConfig", few)
    read: set[str] = set()

    def guarded(entry: Entry) -> MotionSequence:
        read.add(entry.split)
        return dataset.read(entry)

    body = body_arrays(dataset)
    watched = replace(dataset, read=guarded)
    train_model(Run(watched, TrainRequest(model, steps=30), body, tmp_path / "model.part", lambda line: None))
    assert read == {"train", "val"}
