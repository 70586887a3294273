"""Training on a ball whose contact of contact is known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rolls import AXIS, BALL, RADIUS, rolls, true_contact

from odeform.dataset.index import Dataset
from odeform.dataset.training_data import TrainingData, prepare
from odeform.errors import InputError
from odeform.mechanics.rolling.contact import initial_contact
from odeform.mechanics.rolling.support import support_of
from odeform.models.base import Predictor
from odeform.models.rolling.model import RollingModel
from odeform.models.rolling.start import push_inputs
from odeform.models.rolling.training.contact_fit import contact_error_mm, fit_contact
from odeform.models.rolling.training.fit import fit_rolling_body, motions_of
from odeform.models.training.request import TrainRequest
from odeform.motion.reduced_space import POSE, motion_rmse
from odeform.training.train import train


def silent(_: str) -> None: ...


@pytest.fixture(scope="module")
def dataset() -> Dataset:
    return rolls()


@pytest.fixture(scope="module")
def data(dataset: Dataset) -> TrainingData:
    return prepare(dataset, patterns=True)


@pytest.fixture(scope="module")
def predictor(dataset: Dataset, tmp_path_factory: pytest.TempPathFactory) -> Predictor:
    return train(
        dataset, tmp_path_factory.mktemp("rolls") / "rolls.safetensors", "odeform-rolling", steps=6, report=silent
    )


def test_a_dent_that_stays_below_needs_few_patterns(data: TrainingData, dataset: Dataset) -> None:
    rolling = data.space.rolling
    assert rolling is not None
    assert np.allclose(rolling.axis, AXIS, atol=1e-6)
    assert rolling.patterns <= 0.25 * prepare(dataset).space.basis.modes
    whole = prepare(dataset, data.space.basis)
    for y, body in zip(data.reduced["val"], whole.reduced["val"], strict=True):
        assert motion_rmse(data.space.with_modes(y), body, data.space.gyration_radius) < 2e-5
    assert data.reduced["val"].shape[2] == data.space.coordinates == POSE + rolling.patterns


def test_the_true_parameters_explain_the_motions_and_a_fit_approaches_it(data: TrainingData) -> None:
    support, motions = support_of(BALL.points, AXIS), motions_of(data, "train", AXIS, [0])
    start, true = initial_contact(1, 0), true_contact()
    some = motions.some(np.arange(12))
    before, known = (contact_error_mm(contact, support, RADIUS, some) for contact in (start, true))
    free = np.arange(start.terms.size)
    fitted = fit_contact(start, free, support, RADIUS, some, 6, silent)
    assert known < 0.7  # what differences of frames make of the velocity
    assert before > 5.0 * known
    assert contact_error_mm(fitted, support, RADIUS, some) < 0.4 * before


@pytest.mark.slow
def test_a_trained_model_predicts_motions_that_it_has_not_seen(predictor: Predictor, dataset: Dataset) -> None:
    assert isinstance(predictor, RollingModel)
    scores = predictor.checkpoint.scores
    assert scores["rmse_pooled_mm"] < 1.3
    assert scores["deformation_relative"] < 0.15
    assert predictor.schema.window.reach > 0.0


@pytest.mark.slow
def test_a_motion_is_continuous_starts_at_rest_and_goes_on(predictor: Predictor) -> None:
    motion = predictor.solve(parameters={"force": 80.0}, quality="reference")
    assert np.array_equal(motion.vertices(0.0), predictor.rest.points)
    times = np.linspace(0.0, 1.9, 1901)
    centres = motion.vertices(times).mean(axis=1)
    assert np.abs(np.diff(centres, axis=0)).max() < 5e-3
    assert motion.stop_at(1.9) is None
    assert centres[-1, 0] > centres[600, 0] > centres[300, 0]


@pytest.mark.slow
def test_what_is_shown_does_not_depend_on_what_was_asked_before(predictor: Predictor) -> None:
    times = np.array([0.3, 0.02, 0.7, 0.11])
    together = predictor.solve().vertices(times)
    motion = predictor.solve()
    # on some machines products over one row and over several round differently, in single precision
    for time, vertices in zip(times[::-1], together[::-1], strict=True):
        np.testing.assert_allclose(motion.vertices(float(time)), vertices, rtol=0.0, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("damaged", ["law.terms", "start.weights", "readout.first", "rolling.harmonics"])
def test_damaged_checkpoints_are_refused(predictor: Predictor, damaged: str) -> None:
    arrays = {**predictor.checkpoint.arrays, damaged: np.zeros(2)}
    with pytest.raises(InputError, match=damaged):
        RollingModel(replace(predictor.checkpoint, arrays=arrays))
    missing = replace(predictor.checkpoint, arrays={name: a for name, a in arrays.items() if name != damaged})
    with pytest.raises(InputError, match="missing or wrong"):
        RollingModel(missing)


@pytest.mark.slow
def test_later_motions_are_those_of_the_ode_alone(predictor: Predictor) -> None:
    assert isinstance(predictor, RollingModel)
    assert predictor.residual is not None
    end, theta = predictor.residual.stop, np.array([0.2, -0.3, 0.5])
    assert 0.1 < end < 0.5 * predictor.schema.window.stop
    evaluated, quality = predictor.evaluate_basis(predictor.rest, 0.0), predictor.qualities["reference"]
    corrected = predictor.trajectory(theta, evaluated, quality, 1.0)
    alone = predictor.integrate(theta, evaluated, quality, 1.0)
    later, pushed = np.linspace(end, 1.0, 50), np.array([0.01, 0.02, 0.05])
    assert np.allclose(corrected.reduced(later), alone.reduced(later), atol=1e-9)
    assert np.abs(corrected.reduced(pushed) - alone.reduced(pushed)).max() > 1e-4


@pytest.mark.slow
def test_an_interrupted_fit_goes_on_after_its_last_stage(data: TrainingData, tmp_path: Path) -> None:
    request, part, seen = TrainRequest("rolling", steps=5), tmp_path / "state.part", []
    whole, _ = fit_rolling_body(data, request, silent)

    def interrupt(line: str) -> None:
        seen.append(line)
        if len(seen) == 3:  # in the second stage
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fit_rolling_body(data, request, interrupt, part)
    lines: list[str] = []
    resumed, _ = fit_rolling_body(data, replace(request, resume=True), lines.append, part)
    assert lines[0].endswith("with stage 2")
    assert all(np.array_equal(resumed[name], whole[name]) for name in whole)
    with pytest.raises(InputError, match="state of another training"):
        fit_rolling_body(data, replace(request, resume=True, seed=1), silent, part)


def test_pushes_are_known_by_how_they_accelerate(data: TrainingData) -> None:
    schema, theta = data.schema, np.array([[0.3, 0.5, -0.2]])
    mass, force, elevation = (p.denormalise(float(u)) for p, u in zip(schema.learned, theta[0], strict=True))
    ahead, up = 0.01 * force / mass * np.array([np.cos(elevation), np.sin(elevation)])
    assert push_inputs(schema, theta)[0] == pytest.approx([0.3, ahead, up])
    other = replace(schema, parameters=schema.parameters[:2])
    assert np.array_equal(push_inputs(other, theta[:, :2]), theta[:, :2])


def test_data_of_other_motions_are_refused(data: TrainingData, tmp_path: Path) -> None:
    request = TrainRequest("odeform-rolling", steps=1)
    with pytest.raises(InputError, match="rolls about one horizontal axis"):
        fit_rolling_body(replace(data, space=replace(data.space, rolling=None)), request, silent)
    with pytest.raises(InputError, match="expected a round body"):
        fit_rolling_body(replace(data, rest=data.rest * [1.0, 1.0, 0.9]), request, silent)
    with pytest.raises(InputError, match="begin with a push"):
        fit_rolling_body(replace(data, first_free=0), request, silent)
    unseen = replace(data, observed={split: ~of for split, of in data.observed.items()})
    with pytest.raises(InputError, match="no --every"):
        fit_rolling_body(unseen, request, silent)
