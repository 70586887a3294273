"""Which share of a motion is left to the mechanics."""

import numpy as np
import pytest

from odeform.mechanics.contact_parameters import ContactParameters
from odeform.mechanics.step import Projectile
from odeform.models.contact.inputs import ContactInputs
from odeform.models.modal.contact_residual import PushRegression, contact_residual
from odeform.models.modal.elastic_body import elastic_body
from odeform.models.modal.training.pushes import Pushes, _projection
from odeform.models.modal.training.residual_fit import fit_contact_residual
from odeform.models.residual import PARTS
from odeform.motion.reduced_space import POSE
from odeform.simulation.objects.catalog import get_object
from odeform.types import Floats

COUNT, FRAMES, MODES = 40, 5, 3
GAINS = np.array([1.0, 1.0, 2.0])  # by which deformations are larger than mechanics says


class Predicted(Pushes):
    """Mechanics is wrong about their shifts, and right about their deformations but for a smooth rest."""

    def predicted(self, contact_parameters: ContactParameters, pulse: float, step: float) -> Floats:
        return self.own  # pyright: ignore[reportAttributeAccessIssue]


def pushes(seed: int) -> Predicted:
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(COUNT, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    forces = -normals * rng.uniform(1.0, 4.0, (COUNT, 1))
    times = np.arange(FRAMES) / 100.0
    reduced = np.zeros((COUNT, FRAMES, POSE + MODES))
    reduced[..., :3] = times[:, None] * forces[:, None]
    reduced[..., 3:POSE] = times[:, None] * forces[:, None, ::-1]
    rough = rng.normal(size=(COUNT, 1, MODES))  # which no regression can know
    reduced[..., POSE:] = times[:, None] * (rough + 0.1 * forces[:, None])
    made = Predicted(
        elastic_body(get_object("donut"), 12, 8), 0.05 * normals, normals, 0.07 * normals, forces,
        Projectile(0.02, 0.02), times, reduced, reduced[..., 0] * 0.0,
    )  # fmt: skip
    own = np.zeros_like(reduced)
    own[..., :3] = times[:, None] * rng.normal(size=(COUNT, 1, 3))
    own[..., POSE:] = times[:, None] * rough / GAINS
    object.__setattr__(made, "own", own)
    return made


def test_each_part_is_predicted_by_what_knows_it() -> None:
    train, val = pushes(0), pushes(1)
    arrays, settings = fit_contact_residual(train, val, ContactParameters(), 0.04)
    assert settings["shares"]["shift"] == 0.0
    assert settings["shares"]["deformation"] == 1.0
    residual = contact_residual({"times": train.times, **arrays}, settings)
    assert isinstance(residual.regression, PushRegression)
    np.testing.assert_allclose(residual.regression.scale, GAINS, rtol=0.15)
    assert residual.regression.scale[2] > 1.7
    np.testing.assert_array_equal(residual.weight[:POSE], np.repeat([0.0, settings["shares"]["rotation"]], 3))
    np.testing.assert_array_equal(residual.weight[POSE:], residual.regression.scale)
    push = ContactInputs(val.contacts[:1], val.normals[:1], val.forces[:1])
    rest = residual.over_time(push)(val.times)[0]
    error = rest[:, :3] - val.reduced[0, :, :3]
    assert np.abs(error).max() < 0.1 * np.abs(val.reduced[0, :, :3]).max()
    tried = {(trial["part"], trial["share"]): trial["error"] for trial in settings["trials"]}
    for part in PARTS:
        assert tried[part, settings["shares"][part]] == min(error for (name, _), error in tried.items() if name == part)


def test_a_share_that_is_none_is_refused() -> None:
    arrays, settings = fit_contact_residual(pushes(0), pushes(1), ContactParameters(), 0.04)
    with pytest.raises(ValueError, match="expected ODE weights from 0 to 1"):
        contact_residual(arrays, {**settings, "shares": {**settings["shares"], "shift": 1.5}})
    with pytest.raises(ValueError, match="expected 3 gains"):
        contact_residual({**arrays, "gains": np.ones(2)}, settings)
    # files of before shares and gains were fitted have none
    old = {key: array for key, array in arrays.items() if key != "gains"}
    np.testing.assert_array_equal(contact_residual(old, {"blend": settings["blend"]}).weight, np.ones(POSE + MODES))


def test_vertices_without_weight_do_not_count() -> None:
    rng = np.random.default_rng(0)
    basis, weights = rng.normal(size=(30, 3, 4)), np.full(30, 1.0 / 27)
    weights[:3] = 0.0
    coefficients = rng.normal(size=4)
    displacements = basis @ coefficients
    displacements[:3] = 100.0
    np.testing.assert_allclose(displacements.ravel() @ _projection(basis, weights), coefficients)
