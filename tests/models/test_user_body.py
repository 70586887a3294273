"""Bodies that the mechanical model was not trained on."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from odeform.errors import InputError
from odeform.geometry.contact import nearest_on
from odeform.geometry.shape import FittedShape
from odeform.geometry.similarity import Similarity
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.mechanics.step import Projectile
from odeform.models.modal.elastic_body import elastic_body
from odeform.models.modal.training.fit import checkpoint_of
from odeform.models.modal.training.pushes import Pushes
from odeform.models.modal.user_body import UserBody, UserBodyPredictor, takes_user_bodies, user_body
from odeform.models.per_object import PerObject, joined
from odeform.models.registry import load, model_class
from odeform.simulation.contacts import vector_of
from odeform.simulation.objects.catalog import get_object
from odeform.simulation.scenes.contact_force import PULSE, SCENE
from odeform.types import Mesh

SPHERE = Projectile(0.02, 0.02)


def pushed(name: str) -> Pushes:
    """Two pushes that move nothing: enough for a checkpoint."""
    body, two, times = elastic_body(get_object(name), 12, 8), np.zeros((2, 3)), np.arange(20) / 100.0
    empty = np.zeros((2, 20, 18))
    return Pushes(body, two, two, two, two, SPHERE, times, empty, empty[..., 0])


@pytest.fixture(scope="module")
def trained() -> PerObject:
    """A model of the donut, with the contact parameters as it is before training."""
    schema = replace(SCENE.schema, objects=("donut",))
    part = checkpoint_of(schema, np.zeros((2, 6)), pushed("donut"), ContactParameters(), PULSE, 3e4)
    part = replace(part, config={**part.config, "largest": (0.5, 0.1)})
    return PerObject(joined(schema, {"donut": part}), model_class(part.model))


@pytest.fixture(scope="module")
def bottle() -> UserBody:
    """The bottle, as if a user had brought it, twice as fine."""
    item = get_object("bottle")
    rest = item.rest_mesh()
    fine = trimesh.Trimesh(rest.points, rest.faces, process=False).subdivide()
    shape = Mesh(np.asarray(fine.vertices, dtype=np.float32), np.asarray(fine.faces, dtype=np.int32))
    return UserBody(item, elastic_body(item, 12, 8), "bottle", FittedShape(shape, None, Similarity(), shape, None, 0.0))


def test_another_body_is_pushed_where_and_as_hard_as_suits_it(trained: PerObject, bottle: UserBody) -> None:
    assert takes_user_bodies(trained)
    assert not takes_user_bodies(load("kick"))
    predictor = UserBodyPredictor(trained, bottle)
    given = predictor.complete(predictor.parameters_like())
    assert nearest_on(predictor.rest, vector_of(given, "contact")).distance < 1e-6
    weakest, strongest = bottle.item.forces
    assert weakest < np.linalg.norm(vector_of(given, "force")) < strongest
    motion = predictor.solve(bottle.fit.geometry, given)
    moved = motion.vertices(0.04)
    assert motion.stats.status == "ok"
    assert np.abs(moved - bottle.fit.geometry.points).max() > 1e-3
    similarity = predictor.validity.similarity(bottle.fit.geometry)
    assert similarity is not None
    assert not similarity.same
    assert predictor.error_band(given, np.zeros(1)) is None


def test_a_model_of_trained_bodies_only_is_refused(bottle: UserBody) -> None:
    with pytest.raises(InputError, match="knows its trained bodies only"):
        UserBodyPredictor(load("kick"), bottle)


@pytest.mark.slow
def test_a_scan_in_millimetres_that_lies_on_its_side_becomes_a_body(trained: PerObject) -> None:
    ellipsoid = trimesh.creation.icosphere(3, 1.0)
    ellipsoid.apply_scale([40.0, 90.0, 50.0])
    scan = Mesh(np.asarray(ellipsoid.vertices, dtype=np.float32), np.asarray(ellipsoid.faces, dtype=np.int32))
    own = user_body(scan, "egg.obj", up="+z")
    predictor = UserBodyPredictor(trained, own)
    shape = own.fit.geometry.points
    assert np.ptp(shape, axis=0).max() == pytest.approx(0.18, rel=0.05)
    assert shape[:, 2].min() == pytest.approx(0.0, abs=5e-3)
    away = [nearest_on(predictor.rest, point.astype(float)).distance for point in shape[::20]]
    assert max(away) < 5e-3
    assert np.isfinite(predictor.solve(own.fit.geometry).vertices(0.1)).all()


@pytest.mark.slow
def test_an_open_sheet_is_refused_with_the_reason() -> None:
    x, y = np.meshgrid(np.linspace(0, 1, 20), np.linspace(0, 1, 20))
    sheet = trimesh.Trimesh(np.stack([x.ravel(), y.ravel(), 0.05 * np.sin(3 * x.ravel())], axis=1), process=False)
    quads = np.array([[i, i + 1, i + 20, i + 21] for r in range(19) for i in range(20 * r, 20 * r + 19)])
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [1, 3, 2]]]).astype(np.int32)
    with pytest.raises(InputError, match=r"sheet\.obj: the mesh encloses no volume: it is open"):
        user_body(Mesh(np.asarray(sheet.vertices, dtype=np.float32), faces), "sheet.obj")
