"""What models of points learn from."""

import numpy as np
import pytest

from odeform.dataset.index import Dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.errors import InputError
from odeform.models.points.training.point_data import prepare_points


def test_displacements_come_back_from_mean_and_scale(dataset: Dataset) -> None:
    data = prepare_points(dataset, FrameSubsampling(every=4))
    assert len(data.mean.times) == data.moved["train"].shape[1] == 121
    sequence = next(dataset.sequences("train"))
    moved = data.frame.scale * data.moved["train"][0] + data.mean.shifts[:, None]
    distance = np.linalg.norm(sequence.vertices[:121] - sequence.vertices[0], axis=2)
    apart = np.abs(np.linalg.norm(moved, axis=2) - distance).max(axis=1)
    assert apart[data.observed["train"][0]].max() < 1e-5
    assert apart.max() > 1e-5


def test_it_is_of_order_one_about_a_mean_of_nothing(dataset: Dataset) -> None:
    data = prepare_points(dataset)
    train = data.moved["train"].astype(float)
    assert np.sqrt((train**2).mean()) == pytest.approx(1.0, rel=1e-5)
    assert np.abs(np.einsum("n,stni->ti", data.weights, train)).max() < 1e-3 * len(train)
    assert not train[:, 0].any()
    assert np.sqrt((data.x**2).sum(axis=1) @ data.weights) == pytest.approx(1.0, rel=1e-5)


def test_given_frames_have_their_rate_and_end_the_window(dataset: Dataset) -> None:
    data = prepare_points(dataset, given=7)
    assert data.schema.needs_observations
    assert data.schema.window.rate == pytest.approx(120.0 / 7.0)
    assert data.schema.window.stop == pytest.approx(119.0 / 120.0)
    assert data.moved["val"].shape[1] == 120


def test_too_few_frames(dataset: Dataset) -> None:
    with pytest.raises(InputError, match="at least 4 training frames"):
        prepare_points(dataset, given=60)
