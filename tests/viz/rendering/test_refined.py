"""A truth on a coarse mesh, drawn on the finer one of the prediction beside it."""

from dataclasses import replace

import numpy as np
import trimesh
import viser
from stubs import SCHEMA, StubPredictor, recorded

from odeform.motion.recorded import RecordedMotion
from odeform.types import Mesh
from odeform_viz.columns import Column, Columns
from odeform_viz.rendering.refined import refined
from odeform_viz.rendering.scene import SceneView
from odeform_viz.session import Session
from odeform_viz.view import Coloring, ColorScale, DisplayOptions, ViewRequest


def sphere(subdivisions: int) -> Mesh:
    made = trimesh.creation.icosphere(subdivisions, 0.1)
    return Mesh(made.vertices.astype(np.float32), np.asarray(made.faces, np.int32))


def test_values_are_carried_as_vertices_are() -> None:
    coarse, fine = sphere(2), sphere(4)
    finer = refined(coarse, fine)
    assert finer is not None
    np.testing.assert_allclose(finer.values(np.ones(len(coarse.points))), 1.0)
    heights = finer.values(coarse.points[:, 2].astype(float))
    assert np.abs(heights - fine.points[:, 2]).max() < 0.004  # the height of the coarse faces' middles below the sphere


def test_a_truth_that_is_drawn_finely_has_the_colors_of_its_own_values(server: viser.ViserServer) -> None:
    session, view = Session(SCHEMA), SceneView(server, 0.2, lambda: None)
    stub, coarse = StubPredictor(), sphere(1)
    sequence = recorded(stub, {"mass": 0.5})
    points = coarse.points + np.array([0.0, 0.0, 0.1])
    frames = np.stack([points] * len(sequence.times)).astype(np.float32)
    weights = np.full(len(points), 1.0 / len(points), np.float32)
    record = RecordedMotion(SCHEMA, replace(sequence, vertices=frames, faces=coarse.faces, weights=weights))
    columns = Columns.of([Column("stub", stub, stub.rest), Column("truth", record, record.geometry)]).all
    request = ViewRequest(SCHEMA.complete({"mass": 0.5}), float(sequence.times[2]), "balanced", columns)
    values = {columns[0].key: np.zeros(len(stub.rest.points)), columns[1].key: (points[:, 0] > 0.05).astype(float)}
    coloring = Coloring(ColorScale("displacement", "mm", 1.0), values)
    view.publish(session.frame(request), DisplayOptions(color_by="displacement"), coloring)
    handles = [server.scene.get_handle_by_name(f"/world/column_{c.key}/body/colored") for c in columns]
    still, finer = (trimesh_of(handle) for handle in handles)
    assert len(finer.vertices) == len(still.vertices) > len(points)
    seen = np.unique(finer.visual.vertex_attributes["color"], axis=0)  # pyright: ignore[reportAttributeAccessIssue]
    assert len(seen) > 2  # also what lies between a vertex that has a value and one that has none


def trimesh_of(handle: object) -> trimesh.Trimesh:
    assert isinstance(handle, viser.GlbHandle)
    loaded = trimesh.load(trimesh.util.wrap_as_stream(handle.glb_data), file_type="glb", process=False)
    assert isinstance(loaded, trimesh.Scene)
    return next(iter(loaded.geometry.values()))  # pyright: ignore[reportReturnType]
