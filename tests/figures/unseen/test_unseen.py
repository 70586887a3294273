"""Errors of the mechanical model on shapes that it was not trained on."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odeform.checkpoint import Checkpoint, read_checkpoint, write_checkpoint
from odeform.cli import main
from odeform.errors import InputError
from odeform.geometry.contact import nearest_on
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.models.contact.regression import PARTS
from odeform.models.error_band import NOMINAL
from odeform.models.modal.elastic_body import elastic_body
from odeform.models.modal.model import ModalModel
from odeform.models.modal.transferred_residual import shape_distance, transfer_weight, transferred_residual
from odeform.models.modal.user_body import UserBodyPredictor, resting_body
from odeform.models.per_object import PerObject, joined
from odeform.simulation.contacts import vector_of
from odeform.simulation.objects.catalog import get_object
from odeform.simulation.scenes.contact_force import PULSE, SCENE
from odeform.types import Floats, Mesh, MotionSequence
from odeform_figures.bodies.generate import generate
from odeform_figures.bodies.hard import BAD
from odeform_figures.unseen.left_out import without
from odeform_figures.unseen.measure import measure
from odeform_figures.unseen.predictions import nearest_motion
from odeform_figures.unseen.shapes import INSTANCE, UnseenShape, pushes_of, shape_file, simulated
from odeform_figures.unseen.unseen import Plan, unseen

NAMES = ("donut", "bottle")
QUALITIES = {name: {"method": "limex", "step": 5e-3, "dtype": "float64"} for name in ("draft", "balanced", "reference")}

BAND = {"level": 0.0, "by_size": 1.0, "by_distance": 1.0, "times": [0.1, 0.19], "profile": [[0.0, 1.0]] * 2}


def part(name: str) -> Checkpoint:
    """A body with the contact parameters as it is before training, and no correction."""
    body = elastic_body(get_object(name), 12, 8)
    return Checkpoint(
        ModalModel.model,
        replace(SCENE.schema, objects=(name,)),
        {
            "largest": [0.5, 0.1],
            "body": body.to_json(),
            "law": ContactParameters().to_json(),
            "pulse_s": PULSE,
            "projectile": {"radius": 0.02, "mass": 0.02},
            "qualities": QUALITIES,
        },
        {**body.arrays(), **body.shown(), "training.theta": np.zeros((2, 6), dtype=np.float32)},
    )


@pytest.fixture(scope="module")
def checkpoint() -> Checkpoint:
    found = joined(SCENE.schema, {name: part(name) for name in NAMES})
    return replace(found, scores={"per_object": {name: {"rmse_pooled_mm": 1.0, "relative": 0.1} for name in NAMES}})


@pytest.fixture(scope="module")
def trained(checkpoint: Checkpoint) -> PerObject:
    return PerObject(checkpoint, ModalModel)


@pytest.fixture(scope="module")
def donut(trained: PerObject) -> UserBodyPredictor:
    """The trained donut, as if a user had brought it."""
    return UserBodyPredictor(trained, resting_body(get_object("donut"), "donut"))


def motions(predictor: UserBodyPredictor, count: int) -> tuple[MotionSequence, ...]:
    """Some pushes, as the predictor itself has them."""
    item, times, found = predictor.user_body.item, np.arange(5) / 100.0, []
    for given in pushes_of(item, count, 0):
        vertices = predictor.solve(None, {**given, **predictor.parameters_like()}).vertices(times)
        found.append(MotionSequence(times, vertices, item.faces, item.weights, given))
    return tuple(found)


def test_a_model_that_is_the_truth_has_no_error_and_deforms_as_much_as_it_should(donut: UserBodyPredictor) -> None:
    shape = UnseenShape("ring", INSTANCE, "donut", donut.user_body.item, motions(donut, 2))
    found = measure(donut, donut.trained, shape)
    row = found.to_json({"rmse_pooled_mm": 0.5, "relative": 0.1})
    assert found.distance < 1e-3
    assert row["model_mm"] < 1e-4 < row["moved_mm"]
    assert row["rigid_mm"] > 1e-3
    assert row["best_share_of_deformation"] == pytest.approx(1.0, abs=1e-3)
    assert row["ratio"] == row["model_mm"] / 0.5
    assert found.errors.shape == found.predicted.shape == (2, 4)
    assert found.within is None, "it has no band"
    config = {**donut.trained.checkpoint.config, "own_band": BAND}
    told = UserBodyPredictor(PerObject(replace(donut.trained.checkpoint, config=config), ModalModel), donut.user_body)
    assert measure(told, donut.trained, shape).within == 1.0
    off = replace(
        shape,
        motions=tuple(
            replace(one, vertices=one.vertices + one.times.astype(np.float32)[:, None, None]) for one in shape.motions
        ),
    )
    assert measure(told, donut.trained, off).within == 0.0


def test_the_nearest_object_moves_a_shape_that_stands_elsewhere_as_if_it_stood_there(trained: PerObject) -> None:
    rest, times = get_object("bottle").rest_mesh(), np.array([0.0, 0.04])
    (given,) = pushes_of(get_object("bottle"), 1, 0)
    aside = np.array([0.05, -0.02, 0.0])
    there = Mesh(rest.points + aside.astype(np.float32), rest.faces)
    moved = {**given, **{f"contact_{a}": given[f"contact_{a}"] + x for a, x in zip("xyz", aside, strict=True)}}
    one, other = (nearest_motion(trained, "bottle", *push, times) for push in ((rest, given), (there, moved)))
    assert np.abs(one[1]).max() > 1e-3
    assert one == pytest.approx(other, abs=1e-6)


def test_the_same_push_is_drawn_for_a_body_each_time_and_lies_on_it() -> None:
    item = get_object("bottle")
    one, other = pushes_of(item, 3, 5), pushes_of(item, 2, 5)
    assert one[:2] == other
    for given in one:
        assert nearest_on(item.rest_mesh(), vector_of(given, "contact")).distance < 1e-6
        assert item.forces[0] <= np.linalg.norm(vector_of(given, "force")) <= item.forces[1]


def test_distance_does_not_depend_on_where_a_shape_stands_and_less_is_carried_over_farther_away() -> None:
    body = get_object("donut").rest_mesh()
    aside = Mesh(body.points + np.float32([0.1, 0.0, 0.0]), body.faces)
    taller = Mesh(body.points * np.float32([1.0, 1.0, 1.5]), body.faces)
    assert shape_distance(aside, body) < 1e-3 < shape_distance(taller, body)
    assert 1.0 >= transfer_weight(0.0) > transfer_weight(0.1) > 0.0


def test_gains_are_carried_over_by_stiffness(checkpoint: Checkpoint, donut: UserBodyPredictor) -> None:
    """The same body gets its own gains, as much as is carried over; one with stiffer modes those of stiffer modes."""
    gains, times = np.linspace(1.0, 2.0, 12), np.arange(3) / 100.0
    part = PerObject(_corrected(checkpoint, gains, times), ModalModel).parts["donut"]
    assert isinstance(part, ModalModel)
    body, basis = donut.user_body.body, donut._coordinates[1]
    same = transferred_residual(part, body, basis, 0.5)
    np.testing.assert_allclose(same.weight[:18], np.concatenate([np.ones(6), 1.0 + 0.5 * (gains - 1.0)]), atol=1e-6)
    np.testing.assert_allclose(same.weight[18:], 1.5)  # its other modes are stiffer than all of the trained body
    stiffer = transferred_residual(part, replace(body, eigenvalues=1e9 * body.eigenvalues), basis, 0.5)
    np.testing.assert_allclose(stiffer.weight[6:], 1.5)


def _corrected(checkpoint: Checkpoint, gains: Floats, times: Floats) -> Checkpoint:
    """With a correction of the donut that has gains, and adds nothing."""
    settings = {"shares": dict.fromkeys(PARTS, 1.0), "blend": {part: [] for part in PARTS}}
    known = {f"gp.{name}": np.ones((1, 3)) for name in ("contact", "normal", "force")}
    arrays = {"times": times, "gains": gains, "gp.modes": np.zeros((1, len(times) * len(gains))), **known}
    objects = {**checkpoint.config["objects"]}
    objects["donut"] = {**objects["donut"], "correction": settings}
    added = {f"donut/{key}": array for key, array in arrays.items()}
    return replace(checkpoint, config={**checkpoint.config, "objects": objects}, arrays={**checkpoint.arrays, **added})


def test_a_band_in_the_checkpoint_is_that_of_own_bodies(checkpoint: Checkpoint, donut: UserBodyPredictor) -> None:
    assert not donut.knows_untrained_errors
    told = PerObject(replace(checkpoint, config={**checkpoint.config, "own_band": BAND}), ModalModel)
    near, far = (UserBodyPredictor(told, replace(donut.user_body, like=like)) for like in NAMES)
    given = pushes_of(donut.user_body.item, 1, 0)[0]
    found = near.error_band(given, np.array([0.0, 0.1, 0.19]))
    assert near.knows_untrained_errors
    assert found is not None
    assert (found[1:, 0] < found[1:, 1]).all()
    wider = far.error_band(given, np.array([0.1]))
    assert wider is not None
    assert wider[0, 1] > found[1, 1]
    assert "with an error as measured" in near.validity.untrained
    assert NOMINAL == 0.9


def test_an_object_that_is_left_out_is_gone(trained: PerObject) -> None:
    found = without(trained, "donut")
    assert tuple(found.parts) == found.schema.objects == ("bottle",)


def test_a_shape_by_code_that_is_no_body_is_named_with_the_reason(
    checkpoint: Checkpoint, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("odeform_figures.bodies.hard.HARD", {"flat sheet": BAD["plane"]})
    monkeypatch.setattr("odeform_figures.unseen.left_out.MOTIONS", 1)
    path = tmp_path / "model.safetensors"
    write_checkpoint(path, checkpoint)
    plan = Plan(tmp_path / "keep", 1, instances=False, code=True, data="contact-force", workers=1)
    found = unseen(path, plan)
    assert "encloses no volume" in found["not_simulated"]["flat-sheet"][0]
    assert set(found["shapes"]) == {"bottle", "donut"}
    assert found["coverage_90"] is None, "too few shapes"
    assert found["own_band"]["shapes"] == 2


def test_finished_shapes_are_read_again_and_failed_pushes_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, donut: UserBodyPredictor
) -> None:
    (truth,) = motions(donut, 1)
    answers = iter([truth, "2 of 5 tetrahedra are inside out at the end"])
    monkeypatch.setattr("odeform_figures.unseen.shapes._run", lambda item, given: next(answers))
    path = shape_file(tmp_path, "ring", 2, 0)
    one = simulated(path, lambda: UnseenShape("ring", INSTANCE, "donut", donut.user_body.item), 2, 0, 1)
    again = simulated(path, lambda: pytest.fail("it is finished"), 2, 0, 1)
    assert one.failed == again.failed == ("2 of 5 tetrahedra are inside out at the end",)
    assert np.array_equal(again.motions[0].vertices, truth.vertices)
    assert again.motions[0].parameters == truth.parameters
    path.write_bytes(b"PK\x03\x04 no archive")
    with pytest.raises(InputError, match="cannot be read"):
        simulated(path, lambda: one, 2, 0, 1)


def test_a_proportion_that_a_class_does_not_have_is_refused() -> None:
    with pytest.raises(InputError, match="expected proportions ring, tube, height, got ears"):
        generate("donut", factors={"ears": 1.0})


def test_a_model_of_trained_bodies_only_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["unseen", "kick", "--keep", str(tmp_path)]) == 2
    assert "expected a mechanical model of several objects" in capsys.readouterr().err


@pytest.mark.slow
def test_the_command_measures_other_instances_and_attaches_the_band(checkpoint: Checkpoint, tmp_path: Path) -> None:
    path, result = tmp_path / "model.safetensors", tmp_path / "unseen.json"
    write_checkpoint(path, checkpoint)
    keep = tmp_path / "keep"
    command = ["unseen", str(path), "--keep", str(keep), "--object", "donut", "--pushes", "1", "--workers", "1"]
    assert main([*command, "--json", str(result), "--attach"]) == 0
    found = json.loads(result.read_text())
    assert set(found["shapes"]) == {"donut-moderate", "donut-extreme"}
    assert found["kinds"][INSTANCE]["shapes"] == 2
    assert read_checkpoint(path).config["own_band"] == found["own_band"]
    assert len(list(keep.iterdir())) == 2
    assert main([*command, "--kept-only", "--seed", "1"]) == 2, "nothing is kept of another seed"
