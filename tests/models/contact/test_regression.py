"""Regression in the contact's frame."""

import numpy as np
import pytest
from pushes import pushes
from scipy.optimize import approx_fprime

from odeform.dataset.training_data import TrainingData, prepare
from odeform.models.baselines.gp import GaussianProcess
from odeform.models.contact.inputs import FRAMES, ContactInputs, contact_inputs, has_contact
from odeform.models.contact.regression import EXPERTS, ContactRegression
from odeform.models.kernels.likelihood import MarginalLikelihood, fit_kernel
from odeform.models.residual import PARTS
from odeform.simulation.scenes.registry import get_scene


@pytest.fixture(scope="module")
def data() -> TrainingData:
    return prepare(pushes(60).of("plate"), modes=6)


@pytest.fixture(scope="module")
def fitted(data: TrainingData) -> tuple:
    return GaussianProcess.fit(data)


def some_contacts(count: int = 12) -> ContactInputs:
    rng = np.random.default_rng(0)
    normal = rng.normal(size=(count, 3))
    normal[0] = [0.0, 0.0, 1.0]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return ContactInputs(rng.normal(size=(count, 3)), normal, rng.normal(size=(count, 3)))


@pytest.mark.parametrize("frame", FRAMES)
def test_frames_are_rotations(frame: str) -> None:
    """At a contact on top too, where the azimuth means nothing."""
    turns = some_contacts().frames(frame)
    assert np.allclose(turns @ turns.swapaxes(1, 2), np.eye(3))
    assert np.allclose(np.linalg.det(turns), 1.0)


def test_inputs_in_the_normals_frame() -> None:
    inputs = some_contacts()
    groups, force = inputs.features("normal")
    assert [group.shape[1] for group in groups] == [3, 3, 3, 1, 3]
    assert np.allclose(np.linalg.norm(force, axis=1), np.linalg.norm(inputs.force, axis=1))
    assert np.allclose(force[:, :1], groups[3]), "the first axis is the normal"


@pytest.mark.parametrize("frame", ["azimuth", "normal"])
def test_what_turns_with_the_push_about_the_vertical_axis_keeps_its_inputs(frame: str) -> None:
    """But for the contact and its normal themselves, which are given in the axes of the body."""
    one, (c, s) = some_contacts(), (np.cos(0.7), np.sin(0.7))
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    other = ContactInputs(one.contact @ turn.T, one.normal @ turn.T, one.force @ turn.T)
    for a, b in zip(one.features(frame)[0][2:], other.features(frame)[0][2:], strict=True):
        assert np.allclose(a[1:], b[1:])


@pytest.mark.parametrize("linear", [0, 4])
def test_the_gradient_of_the_likelihood(linear: int) -> None:
    rng = np.random.default_rng(1)
    x, force = rng.normal(size=(20, 6)), rng.normal(size=(20, 3))
    objective = MarginalLikelihood(x, force, x[:, :4] + 0.1 * rng.normal(size=(20, 4)), 6, linear)
    logs = 0.3 * rng.normal(size=7 + (linear + 1 if linear else 0))
    numeric = approx_fprime(logs, lambda at: objective(at)[0], 1e-6)
    assert np.allclose(objective(logs)[1], numeric, atol=1e-6)


def test_an_input_without_effect_gets_a_long_length_scale() -> None:
    rng = np.random.default_rng(2)
    x = rng.normal(size=(60, 2))
    logs = fit_kernel(x, np.zeros((60, 3)), np.sin(2.0 * x[:, :1]), 0)
    assert logs[1] > logs[0] + np.log(2.0)


def test_a_scene_with_contacts_is_regressed_in_their_frame(data: TrainingData, fitted: tuple) -> None:
    assert has_contact(data.schema)
    assert not has_contact(get_scene("kick").schema)
    assert "blend" in fitted[1]


def test_validation_motions_are_predicted(data: TrainingData, fitted: tuple) -> None:
    """With less than a third of the error of the mean motion, in each part."""
    arrays, settings = fitted
    assert set(settings["blend"]) == set(PARTS)
    assert all(len(shares) == len(EXPERTS) and min(shares) >= 0.0 for shares in settings["blend"].values())
    model = ContactRegression(arrays, settings)
    predicted = model.predict(contact_inputs(data.schema, data.theta["val"], data.space))
    truth = data.reduced["val"]
    mean = data.reduced["train"].mean(axis=0)
    for columns in PARTS.values():
        error, spread = (((one - truth)[..., columns] ** 2).mean() for one in (predicted, mean))
        assert error < 0.1 * spread


def test_only_what_is_used_is_stored(fitted: tuple) -> None:
    arrays, settings = fitted
    for part, shares in settings["blend"].items():
        stored = [f"gp.{part}.{index}.logs" in arrays for index in range(len(EXPERTS))]
        assert stored == [share > 0.0 for share in shares]


def test_files_with_weights_of_the_experts_still_load(data: TrainingData, fitted: tuple) -> None:
    """Older ones hold what is solved for now."""
    arrays, settings = fitted
    solved = ContactRegression(arrays, settings)
    old = {name: array for name, array in arrays.items() if not name.endswith((".outputs", ".step"))}
    for part, experts in solved._experts.items():
        used = [index for index, share in enumerate(settings["blend"][part]) if share]
        for index, (_, expert) in zip(used, experts, strict=True):
            old[f"gp.{part}.{index}.weights"] = expert.regression.weights
            old[f"gp.{part}.{index}.mean"] = expert.mean
    asked = contact_inputs(data.schema, data.theta["val"], data.space)
    assert np.allclose(ContactRegression(old, settings).predict(asked), solved.predict(asked), rtol=0.0, atol=1e-6)
