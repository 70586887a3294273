"""Training of the mechanical model on motions whose contact_parameters is known."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from odeform.dataset.index import Dataset, Entry
from odeform.errors import InputError
from odeform.geometry.contact import RADIUS
from odeform.geometry.rigid import rotation_from_vector
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.mechanics.step import Projectile
from odeform.models.modal.coordinates import coordinates_of
from odeform.models.modal.elastic_body import elastic_body
from odeform.models.modal.model import ModalModel
from odeform.models.modal.training import contact_fit as contact_fit
from odeform.models.modal.training import fit as mechanical
from odeform.models.modal.training.contact_fit import fit_contact_parameters, relative_errors
from odeform.models.modal.training.parameter_cache import SHARED, ParameterCache
from odeform.models.modal.training.pushes import Pushes
from odeform.models.per_object import PerObject
from odeform.motion.reduced_space import POSE
from odeform.simulation.objects.catalog import get_object
from odeform.simulation.scenes.contact_force import PULSE, SCENE
from odeform.training.train import train
from odeform.types import MotionSequence

PARAMETERS = ContactParameters(floor_friction=0.6, stiffness=0.8)
SPHERE = Projectile(RADIUS, SCENE.fixed["projectile_mass_kg"])
SPLITS = ("train", "train", "train", "val", "test")


@pytest.fixture(scope="module")
def drawn() -> list[dict]:
    assert SCENE.sampler is not None
    return SCENE.sampler("donut", len(SPLITS), 0)


@pytest.fixture(scope="module")
def motions(drawn: list[dict]) -> Pushes:
    """Pushes of the donut as the contact parameters have them, truth included."""
    body = elastic_body(get_object("donut"), 12, 8)
    contacts, forces = (np.array([[d[f"{kind}_{a}"] for a in "xyz"] for d in drawn]) for kind in ("contact", "force"))
    normals = -forces / np.linalg.norm(forces, axis=1, keepdims=True)
    contacts = contacts - body.anchor
    times = np.arange(20) / 100.0
    empty = np.zeros((len(drawn), len(times), 18))
    pushes = Pushes(body, contacts, normals, contacts + RADIUS * normals, forces, SPHERE, times, empty, empty[..., 0])
    return replace(pushes, reduced=pushes.predicted(PARAMETERS, PULSE, 2.5e-3))


@pytest.mark.slow
def test_the_law_is_found_again(motions: Pushes) -> None:
    start = ContactParameters()
    before = np.square(relative_errors(motions, motions.predicted(start, PULSE, 2.5e-3))).sum()
    names = ("floor_friction", "stiffness")
    found = fit_contact_parameters([motions], PULSE, start, names, lambda _: None)
    after = np.square(relative_errors(motions, motions.predicted(found, PULSE, 2.5e-3))).sum()
    assert after < 1e-3 * before
    assert found.floor_friction == pytest.approx(PARAMETERS.floor_friction, rel=0.02)
    assert found.stiffness == pytest.approx(PARAMETERS.stiffness, rel=0.02)


@pytest.fixture(scope="module")
def dataset(motions: Pushes, drawn: list[dict]) -> Dataset:
    """The same pushes, as vertices."""
    body, held, entries = motions.body, {}, []
    _, basis = coordinates_of(body)
    rest = get_object("donut").rest_mesh()
    for index, (split, given, y) in enumerate(zip(SPLITS, drawn, motions.reduced, strict=True)):
        deformed = body.points - body.anchor + np.einsum("nik,tk->tni", basis, y[:, POSE:])
        turned = deformed @ rotation_from_vector(y[:, 3:POSE]).swapaxes(1, 2)
        vertices = (turned + (y[:, :3] + body.anchor)[:, None]).astype(np.float32)
        vertices[0] = rest.points
        name, parameters = f"contact-force_donut_{index:05d}", {"object": "donut", **given}
        held[name] = MotionSequence(motions.times, vertices, rest.faces, body.weights, parameters, name)
        entries.append(Entry(name, split, parameters, sha256=name))
    schema = replace(SCENE.schema, objects=("donut",))
    return Dataset(Path("donuts"), schema, tuple(entries), lambda entry: held[entry.name], SCENE.fixed)


@pytest.mark.slow
def test_a_trained_checkpoint_predicts_pushes(
    dataset: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(contact_fit, "EVALUATIONS", 1)  # fewer than it takes to learn
    predictor = train(dataset, tmp_path / "model.safetensors", report=lambda _: None)
    assert isinstance(predictor, PerObject)
    assert set(predictor.qualities) == {"draft", "balanced", "reference"}
    truth = next(dataset.sequences("test"))
    motion = predictor.solve(None, truth.parameters)
    frontier = predictor.frontier_of(motion.parameters)
    assert {predictor.parts["donut"].qualities[name] for name in ("draft", "balanced")} <= {p.quality for p in frontier}
    errors = [point.solver_error_mm for point in frontier]
    assert errors == sorted(errors, reverse=True)
    assert np.array_equal(motion.vertices(0.0), predictor.rest_of(truth.parameters).points)
    moved = motion.vertices(truth.times)
    assert np.isfinite(moved).all()
    assert motion.stats.status == "ok"
    away = (moved[-1] - moved[0]).mean(axis=0)
    force = np.array([truth.parameters[f"force_{axis}"] for axis in "xyz"])
    assert away[:2] @ force[:2] > 0.0, "it goes where it is pushed"
    fine = predictor.solve(None, truth.parameters, "reference").vertices(truth.times)
    assert np.abs(moved - fine).max() < 1e-3
    still = predictor.solve(None, {**truth.parameters, "force": [0.0, 0.0, 0.0]})
    assert np.abs(still.vertices(0.19) - still.vertices(0.0)).max() < 1e-5


@pytest.mark.slow
def test_finished_laws_are_not_fitted_again(dataset: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "model.safetensors"
    known_parameters = ParameterCache(tmp_path / "model.safetensors.part", dataset, 0)
    known_parameters.add(SHARED, ContactParameters())
    known_parameters.add("donut", PARAMETERS)

    def fit(*given: object, **more: object) -> None:
        raise AssertionError("it is finished")

    monkeypatch.setattr(mechanical, "fit_contact_parameters", fit)
    predictor = train(dataset, out, without=["residual"], resume=True, report=lambda _: None)
    assert isinstance(predictor, PerObject)
    part = predictor.parts["donut"]
    assert isinstance(part, ModalModel)
    assert part.contact_parameters == PARAMETERS
    assert part.residual is None
    assert not known_parameters.path.exists(), "it is of no use any more"


@pytest.mark.parametrize(
    ("names", "expected"), [(["cat"], "'cat': scene contact-force has donut"), (["donut", "dog"], "'dog'")]
)
def test_an_object_that_the_data_do_not_have_is_refused(
    dataset: Dataset, tmp_path: Path, names: list[str], expected: str
) -> None:
    with pytest.raises(InputError, match=expected):
        train(dataset, tmp_path / "model.safetensors", "nearest", objects=names, report=lambda _: None)


def test_other_data_are_refused(dataset: Dataset, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected data of scene contact-force"):
        train(replace(dataset, fixed={}), tmp_path / "model.safetensors", report=lambda _: None)


def test_frames_after_the_window_are_not_trained_on(
    dataset: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = []

    def fit(given: Dataset, known_parameters: ParameterCache, seed: int, report: object, with_residual: bool) -> None:
        seen.append((given.schema.window.stop, seed, with_residual))
        raise InputError("enough")

    monkeypatch.setattr(mechanical, "fit_mechanical", fit)
    asked: tuple[dict[str, Any], ...] = ({"window": (0, 11)}, {}, {"without": ["residual"]})
    for options in asked:
        with pytest.raises(InputError, match="enough"):
            train(dataset, tmp_path / "model.safetensors", report=lambda _: None, **options)
    whole = dataset.schema.window.stop
    assert seen == [(0.1, 0, True), (whole, 0, True), (whole, 0, False)]
    refused: tuple[dict[str, Any], ...] = ({"every": 2}, {"steps": 10}, {"without": ["ode"]})
    for options in refused:
        with pytest.raises(InputError, match=r"expected no --every|modal has residual"):
            train(dataset, tmp_path / "model.safetensors", report=lambda _: None, **options)
