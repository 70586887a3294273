"""Objects of another mass and stiffness: how they sag, how they move, and that they come to rest."""

import pickle
from typing import Any

import numpy as np
import pytest
import torch

import odeform
from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.models.modal.model import ModalModel
from odeform.motion.reduced_motion import as_reduced
from odeform.types import Floats

DONUT = {"object": "donut"}


@pytest.fixture(scope="module")
def model() -> Predictor:
    return odeform.load("contact-force")


@pytest.fixture(scope="module")
def own(model: Predictor) -> dict[str, Any]:
    return model.complete(DONUT)


def changed(own: dict[str, Any], mass: float = 1.0, young: float = 1.0, force: float = 1.0) -> dict[str, Any]:
    forces = {f"force_{axis}": force * own[f"force_{axis}"] for axis in "xyz"}
    return {**own, **forces, "mass": mass * own["mass"], "young": young * own["young"]}


def test_each_object_has_its_own_mass_and_stiffness(model: Predictor, own: dict[str, Any]) -> None:
    assert own["mass"] == pytest.approx(0.199, abs=1e-3)
    assert own["young"] == pytest.approx(30.0)
    chip = model.complete({"object": "chip"})
    assert (chip["mass"], chip["young"]) == pytest.approx((0.0041, 1300.0), rel=0.01)


def test_a_heavy_body_sags_as_a_soft_one_and_a_stiff_one_less(model: Predictor) -> None:
    cat = model.complete({"object": "cat"})

    def height(**ratios: float) -> float:
        return float(model.settled(changed(cat, **ratios)).points[:, 2].max())

    usual, heavy, soft, stiff = height(), height(mass=2.0), height(young=0.5), height(young=2.0)
    assert heavy == pytest.approx(soft, abs=2e-5)
    assert usual - heavy > 1e-4
    # by half of the weight, where a heavy one sags by all of it
    assert stiff - usual == pytest.approx(0.5 * (usual - heavy), rel=0.3)


@pytest.mark.parametrize("ratios", [{"mass": 2.0}, {"mass": 0.5}, {"young": 0.5}, {"young": 2.0}])
def test_a_body_that_nobody_pushes_stays_where_it_rests(
    model: Predictor, own: dict[str, Any], ratios: dict[str, float]
) -> None:
    motion = model.solve(parameters=changed(own, force=0.0, **ratios))
    rest = model.settled(changed(own, force=0.0, **ratios))
    np.testing.assert_array_equal(motion.vertices(0.0), rest.points)
    assert np.abs(motion.vertices(np.array([0.1, 0.5])) - rest.points).max() < 1e-4


def test_a_lighter_body_moves_farther_and_a_softer_one_deforms_more(model: Predictor, own: dict[str, Any]) -> None:
    def most(motion: odeform.Motion) -> tuple[float, float]:
        times = np.linspace(0.0, 0.19, 20)
        return float(np.abs(motion.pose(times)[:, :3, 3]).max()), float(motion.deformation_rms(times).max())

    usual, light, soft = (most(model.solve(parameters=changed(own, **r))) for r in ({}, {"mass": 0.5}, {"young": 0.5}))
    assert light[0] > 1.5 * usual[0]
    assert soft[1] > 1.5 * usual[1]


def test_a_motion_goes_on_without_a_jump_until_the_body_rests(model: Predictor) -> None:
    motion, stop = model.solve(parameters={"object": "cat"}), model.schema.window.stop
    before, after = motion.vertices(np.array([stop, stop + 1e-5]))
    speed = np.abs(motion.vertices(stop) - motion.vertices(stop - 1e-3)).max() / 1e-3
    assert np.abs(after - before).max() < 1e-6 + 2e-5 * speed
    assert speed > 5e-3, "it still moves where the window ends"
    late = motion.vertices(np.array([1.3, 1.4]))
    assert np.abs(late[1] - late[0]).max() < 1e-4
    assert np.abs(late[0] - motion.vertices(0.0)).max() > 1e-3
    assert motion.status == "ok"


def test_a_batch_and_a_pickled_motion_are_as_the_motion(model: Predictor, own: dict[str, Any]) -> None:
    heavy, times = changed(own, mass=1.7, young=0.6), np.array([0.05, 0.3])
    motion = model.solve(parameters=heavy, until=0.3)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(motion)).vertices(times), motion.vertices(times))
    batch = model.solve_batch({**heavy, "mass": np.array([heavy["mass"], own["mass"]])})
    np.testing.assert_array_equal(batch.vertices(times)[0], motion.vertices(times))


def test_a_gradient_by_the_mass_is_refused(model: Predictor) -> None:
    with pytest.raises(InputError, match="mass: has no gradients"):
        model.torch({**DONUT, "mass": torch.tensor(0.2, requires_grad=True)}, [0.1])


def test_the_residual_moves_a_heavier_body_less_and_a_lighter_one_as_it_was_trained(
    model: Predictor, own: dict[str, Any]
) -> None:
    part, alone = model.model_of(own), odeform.load("contact-force").model_of(own)
    assert isinstance(alone, ModalModel)
    alone.residual = None
    times = np.array([0.04, 0.1])

    def added(mass: float) -> Floats:
        with_it, without = (as_reduced(m.solve(parameters=changed(own, mass=mass))) for m in (part, alone))
        return (with_it.coordinates(times) - without.coordinates(times))[:, 3:6]

    usual, heavy, light = added(1.0), added(4.0 / 3.0), added(0.75)
    # of one object, the rotation by mechanics has the weight one: all that is added is regressed
    np.testing.assert_allclose(heavy, 0.75 * usual, rtol=0.05)
    np.testing.assert_allclose(light, usual, rtol=0.05)
