"""A velocity field between given frames."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.models.points.occupancy_flow import OccupancyFlow
from odeform.models.registry import load, observations
from odeform.motion.recorded import RecordedMotion
from odeform.training.train import train
from odeform.types import MotionSequence, PointCloud


@pytest.fixture(scope="module")
def flow(point_models: dict[str, Path]) -> OccupancyFlow:
    predictor = load(point_models["occupancy-flow"])
    assert isinstance(predictor, OccupancyFlow)
    return predictor


@pytest.fixture(scope="module")
def record(dataset: Dataset) -> MotionSequence:
    return next(dataset.sequences("test"))


@pytest.fixture(scope="module")
def given(flow: OccupancyFlow, record: MotionSequence) -> MotionSequence:
    out = observations(flow.schema, record)
    assert out is not None
    return out


def test_it_is_given_every_fourth_frame(flow: OccupancyFlow, given: MotionSequence, dataset: Dataset) -> None:
    assert flow.schema.needs_observations
    assert flow.schema.window.rate == pytest.approx(30.0)
    assert given.times[1] == pytest.approx(4.0 / 120.0)
    assert observations(dataset.schema, given) is None


def test_on_given_frames_it_is_these(flow: OccupancyFlow, record: MotionSequence, given: MotionSequence) -> None:
    motion = flow.solve(record.rest, record.parameters, observed=given)
    np.testing.assert_allclose(motion.vertices(given.times), given.vertices, atol=2e-5)
    assert np.array_equal(motion.vertices(0.0), record.vertices[0].astype(np.float32))
    assert np.array_equal(motion.vertices(5.0), motion.vertices(1.2))


def test_between_them_it_learned_from_others(flow: OccupancyFlow, dataset: Dataset) -> None:
    """Better than straight lines."""
    ours, straight = [], []
    for record in dataset.sequences("test"):
        given = observations(flow.schema, record)
        assert given is not None
        truth = record.until(1.0)
        predicted = flow.solve(truth.rest, truth.parameters, observed=given).vertices(truth.times)
        lines = RecordedMotion(flow.schema, given).sequence
        index = np.minimum((truth.times * 30.0 + 1e-9).astype(int), len(lines.times) - 2)
        share = (truth.times * 30.0 - index)[:, None, None]
        line = (1.0 - share) * lines.vertices[index] + share * lines.vertices[index + 1]
        ours.append(((predicted - truth.vertices) ** 2).mean())
        straight.append(((line - truth.vertices) ** 2).mean())
    assert np.sqrt(np.mean(ours)) < np.sqrt(np.mean(straight))


def test_points_move_alike_whatever_they_are_asked_with(
    flow: OccupancyFlow, record: MotionSequence, given: MotionSequence
) -> None:
    whole = flow.solve(record.rest, record.parameters, observed=given)
    few = np.random.default_rng(0).permutation(len(record.vertices[0]))[:9]
    part = flow.solve(PointCloud(record.vertices[0][few]), record.parameters, observed=given)
    times = np.linspace(0.0, 1.0, 23)
    assert np.abs(part.vertices(times) - whole.vertices(times)[:, few]).max() < 2e-6


def test_what_it_cannot_do_is_said(
    flow: OccupancyFlow, record: MotionSequence, given: MotionSequence, dataset: Dataset, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="none were given"):
        flow.solve(None, record.parameters)
    with pytest.raises(InputError, match="30 per second"):
        flow.solve(None, record.parameters, observed=record)
    with pytest.raises(InputError, match="from 0 s on"):
        flow.solve(None, record.parameters, observed=replace(given, times=given.times + 0.1))
    with pytest.raises(InputError, match="every of at least 2"):
        train(dataset, tmp_path / "a", "occupancy-flow", steps=1)
