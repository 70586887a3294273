from dataclasses import replace

import numpy as np
import pytest

from odeform.dataset.index import Dataset
from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.evaluation.metrics import evaluate
from odeform.evaluation.scores import Scores
from odeform.geometry.rigid import rotation_from_vector, rotation_z
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.types import MotionSequence

ALL = np.ones(3, dtype=bool)
ROUNDING = 1e-5  # of a score: positions are in single precision, and products of other sizes round otherwise


def score(*pairs: tuple[np.ndarray, MotionSequence, np.ndarray]) -> dict:
    """Scores of predictions with masks of the frames that count; the others lie between."""
    scores = Scores()
    for predicted, truth, counted in pairs:
        scores.add(predicted, truth, counted, ~counted)
    return scores.result()


def wobbling(frames: int = 3, seed: int = 0) -> MotionSequence:
    """A body that shifts, turns and deforms."""
    rng = np.random.default_rng(seed)
    rest = rng.normal(size=(20, 3))
    vertices = np.repeat(rest[None], frames, axis=0)
    for k in range(1, frames):
        vertices[k] = (rest + 0.05 * rng.normal(size=rest.shape)) @ rotation_from_vector(0.2 * k * np.ones(3)).T + k
    faces = np.array([[0, 1, 2]])
    return MotionSequence(np.arange(frames) / 10.0, vertices, faces, rng.dirichlet(np.ones(20)))


def off_by(truth: MotionSequence, *millimetres: float) -> np.ndarray:
    """Predictions wrong by so much in every coordinate of each frame."""
    return truth.vertices + 1e-3 * np.array(millimetres)[:, None, None]


def test_a_perfect_prediction() -> None:
    truth = wobbling()
    scores = score((truth.vertices, truth, ALL))
    for name in ("rmse_mm", "mae_mm", "rmse_pooled_mm", "vertex_mm", "relative", "deformation_relative"):
        assert scores[name] == pytest.approx(0.0, abs=1e-9)


def test_one_millimetre_everywhere() -> None:
    truth = wobbling()
    scores = score(*[(off_by(truth, 1.0, 1.0, 1.0), truth, ALL)] * 2)
    for name in ("rmse_mm", "mae_mm", "mse_mm2", "rmse_pooled_mm", "mae_pooled_mm", "mse_pooled_mm2"):
        assert scores[name] == pytest.approx(1.0)
    assert scores["vertex_mm"] == pytest.approx(np.sqrt(3.0))
    assert scores["per_frame_rmse_mm"] == pytest.approx([1.0, 1.0])
    assert scores["deformation_relative"] == pytest.approx(0.0, abs=1e-9)
    assert scores["sequences"] == 2


def test_two_frames_by_hand() -> None:
    """Errors of 1 and 3 mm: the mean of the frames' RMSE is 2, the root of the mean square is sqrt(5)."""
    truth = wobbling()
    scores = score((off_by(truth, 700.0, 1.0, -3.0), truth, ALL))
    assert scores["rmse_mm"] == pytest.approx(2.0)
    assert scores["mae_mm"] == pytest.approx(2.0)
    assert scores["mse_mm2"] == pytest.approx(5.0)
    assert scores["rmse_pooled_mm"] == pytest.approx(np.sqrt(5.0))
    assert scores["rmse_mm"] ** 2 < scores["mse_mm2"]
    assert scores["per_frame_rmse_mm"] == pytest.approx([1.0, 3.0])


def test_sequences_count_by_their_frames() -> None:
    short, long = wobbling(2), wobbling(5)
    pairs = [
        (off_by(short, 0.0, 6.0), short, np.ones(2, dtype=bool)),
        (off_by(long, 0.0, 1.0, 1.0, 1.0, 1.0), long, np.ones(5, dtype=bool)),
    ]
    scores = score(*pairs)
    assert scores["rmse_mm"] == pytest.approx(2.0)
    assert scores["mse_pooled_mm2"] == pytest.approx(8.0)
    assert scores["per_frame_rmse_mm"] == []


def test_frames_off_the_grid_count_apart() -> None:
    truth = wobbling()
    scores = score((off_by(truth, 0.0, 1.0, 5.0), truth, np.array([True, True, False])))
    assert scores["rmse_pooled_mm"] == pytest.approx(1.0)
    assert scores["off_grid_rmse_mm"] == pytest.approx(5.0)
    assert score((truth.vertices, truth, ALL))["off_grid_rmse_mm"] is None


def test_standing_still_is_wrong_by_the_whole_motion() -> None:
    truth = wobbling()
    still = np.repeat(truth.vertices[:1], 3, axis=0)
    scores = score((still, truth, ALL))
    assert scores["relative"] == pytest.approx(1.0)
    assert scores["deformation_relative"] == pytest.approx(1.0)


def test_deformation_is_seen_apart_from_the_pose() -> None:
    truth = wobbling()
    spin = rotation_from_vector(np.array([[0.0, 0.0, 0.0], [0.4, 0.1, 0.0], [0.0, -1.0, 0.5]]))
    wrong_pose = truth.vertices @ spin.swapaxes(1, 2) + np.array([0.0, 0.2, 0.3])[:, None, None]
    scores = score((wrong_pose, truth, ALL))
    assert scores["relative"] > 0.1
    assert scores["deformation_relative"] == pytest.approx(0.0, abs=1e-9)


def test_nothing_to_score() -> None:
    with pytest.raises(InputError):
        score()


def test_a_window_scores_its_frames(dataset: Dataset, predictors: dict[str, Predictor]) -> None:
    whole = evaluate(predictors["pod-rbf"], dataset, "test")
    part = evaluate(predictors["pod-rbf"], dataset, "test", window=(30, 60))
    # frame 0 is given and has no score, so frame k is number k - 1
    squares = np.square(whole["per_frame_rmse_mm"])
    assert len(squares) == 120
    assert part["mse_pooled_mm2"] == pytest.approx(squares[29:59].mean(), rel=1e-6)
    assert evaluate(predictors["pod-rbf"], dataset, "test", window=(0, 500))["mse_mm2"] == whole["mse_mm2"]


def test_coverage_in_tenths_of_each_parameter(dataset: Dataset, predictors: dict[str, Predictor]) -> None:
    bundled = open_dataset("mass-elastic")
    few = replace(bundled, entries=tuple(bundled.select("test")[:12]))
    found = evaluate(load("mass-elastic"), few, "test")
    tenths = found["coverage_tenths"]
    assert set(tenths) == {"mass", "bending"}
    for shares in tenths.values():  # the first two tenths have two motions
        assert np.average(shares, weights=[2, 2] + [1] * 8) == pytest.approx(found["coverage_90"])
    assert min(tenths["mass"]) < max(tenths["mass"])
    assert evaluate(predictors["pod-rbf"], dataset, "test")["coverage_tenths"] == {}  # without a band


def test_parts_are_scored_in_passing(dataset: Dataset, predictors: dict[str, Predictor]) -> None:
    apart = evaluate(predictors["pod-rbf"], dataset, "test", window=(30, 60))
    whole = evaluate(predictors["pod-rbf"], dataset, "test", parts=[(30, 60)])
    for name in ("rmse_pooled_mm", "mae_pooled_mm", "deformation_relative"):
        assert whole["30:60"][name] == pytest.approx(apart[name], rel=1e-5)
    assert whole["rmse_pooled_mm"] == evaluate(predictors["pod-rbf"], dataset, "test")["rmse_pooled_mm"]


@pytest.mark.parametrize("window", [(500, 600), (0, 1)])
def test_a_window_without_frames(dataset: Dataset, predictors: dict[str, Predictor], window: tuple[int, int]) -> None:
    with pytest.raises(InputError):
        evaluate(predictors["nearest"], dataset, "test", window)


def test_the_impact_is_scored_as_a_window_of_its_span(dataset: Dataset, predictors: dict[str, Predictor]) -> None:
    with_impact = replace(dataset, schema=replace(dataset.schema, impact=(0.25, 0.75)))
    whole = evaluate(predictors["pod-rbf"], with_impact, "test")
    part = evaluate(predictors["pod-rbf"], dataset, "test", window=(30, 90))
    assert len(part["per_frame_rmse_mm"]) == 60
    for name, value in whole["impact"].items():
        assert part[name] == (pytest.approx(value, rel=ROUNDING) if value else value), name
    assert {name: whole[name] for name in part} == evaluate(predictors["pod-rbf"], dataset, "test")
    # neither a scene without an impact has it, nor a window that was asked for
    assert "impact" not in part
    assert "impact" not in evaluate(predictors["pod-rbf"], with_impact, "test", window=(30, 90))


def test_frames_between_the_learned_ones_count_apart(dataset: Dataset, predictors: dict[str, Predictor]) -> None:
    """Test sequences have four times the rate: every fourth frame counts, the others are off the grid."""
    every_fourth = replace(dataset, read=lambda entry: dataset.read(entry).until(1.0, every=4))
    fine = evaluate(predictors["pod-rbf"], dataset, "test")
    coarse = evaluate(predictors["pod-rbf"], every_fourth, "test")
    assert coarse.pop("off_grid_rmse_mm") is None
    for name, value in coarse.items():
        # nor is 1 / 120 quite four times 1 / 480
        assert fine[name] == (pytest.approx(value, rel=ROUNDING) if value else value), name
    squares = []
    for sequence in dataset.sequences("test"):
        motion = predictors["pod-rbf"].solve(sequence.rest, sequence.parameters)
        between = np.arange(481) % 4 != 0
        error = motion.vertices(sequence.times[between]) - sequence.vertices[between].astype(float)
        squares.append(1e6 * (error**2).mean())
    assert fine["off_grid_rmse_mm"] == pytest.approx(np.sqrt(np.mean(squares)), rel=1e-6)


def test_a_sequence_that_ended_is_scored_where_it_lies(dataset: Dataset, predictors: dict[str, Predictor]) -> None:
    """Cut at 0.5 s, as if at rest: the frames after are held up against the last one."""
    cut = replace(dataset, read=lambda entry: dataset.read(entry).until(0.5))
    scores = evaluate(predictors["nearest"], cut, "train")
    by_frame = np.array(scores["per_frame_rmse_mm"])
    assert by_frame.shape == (120,)
    assert by_frame[:60].max() < 0.2
    squares = []
    for sequence in dataset.sequences("train"):
        motion = predictors["nearest"].solve(sequence.rest, sequence.parameters)
        squares.append(1e6 * ((motion.vertices(0.9) - sequence.vertices[60].astype(float)) ** 2).mean())
    # frame 0 has no score, so frame 108 is number 107
    assert by_frame[107] == pytest.approx(np.sqrt(np.mean(squares)), rel=1e-6)
    assert by_frame[107] > 10.0


def test_learning_beats_the_mean_motion(dataset: Dataset, predictors: dict[str, Predictor]) -> None:
    train = [s.vertices @ rotation_z(s.parameters["azimuth"]) for s in dataset.sequences("train")]
    mean = np.mean(train, axis=0)
    guesses = [
        (mean @ rotation_z(s.parameters["azimuth"]).T, s.until(1.0, every=4), np.ones(len(mean), dtype=bool))
        for s in dataset.sequences("test")
    ]
    by_mean = score(*guesses)["rmse_pooled_mm"]
    assert evaluate(predictors["pod-rbf"], dataset, "test")["rmse_pooled_mm"] < 0.75 * by_mean


def test_another_scene(dataset: Dataset, predictors: dict[str, Predictor]) -> None:
    other = replace(dataset, schema=replace(dataset.schema, scene="throw"))
    with pytest.raises(InputError, match="throw"):
        evaluate(predictors["nearest"], other, "test")
