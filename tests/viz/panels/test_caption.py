"""The caption says what is in view."""

import viser
from stubs import StubPredictor

from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.columns import Column

Stubbed = tuple[App, LoopbackClient]


def test_scene_model_and_shape_are_named(stubbed: Stubbed) -> None:
    assert "<b>stub</b> · stub" in stubbed[1].text()


def test_exaggeration_and_the_scale_are_stated(stubbed: Stubbed) -> None:
    app, client = stubbed
    assert "exaggerated" not in client.text()
    assert "displacement" not in client.text()
    client.set("exaggerate", 3.0)
    assert client.until(lambda: "deformation exaggerated 3 times" in client.text())
    client.set("colour by", "displacement")
    assert client.until(lambda: "displacement from the rest shape, mm (scale of the whole motion)" in client.text())
    scale = app.presenter.scale
    assert scale is not None
    assert client.until(lambda: f"≥ {scale.top:g}" in client.text())
    assert "<rect" in client.text().split('data-odeform-view="scale"')[1].split("</svg>")[0]  # the histogram
    client.set("scale of this moment", True)
    assert client.until(lambda: "displacement from the rest shape, mm (scale of this moment)" in client.text())


def test_overlaid_columns_have_a_legend_and_their_own_colors(stubbed: Stubbed) -> None:
    app, client = stubbed
    stub = StubPredictor()
    app.columns.add(Column("other <b>", stub, stub.rest))
    app.page.columns_changed()
    client.set("colour by", "displacement")
    client.set("overlay", True)
    assert client.until(lambda: "other &lt;b&gt;</span>" in client.text())
    assert client.until(lambda: app.presenter.scale is None)


def test_only_the_deformation_is_exaggerated(stubbed: Stubbed) -> None:
    app, client = stubbed
    body, part = (app.server.scene.get_handle_by_name(f"/world/column_0/body{node}") for node in ("", "/part_0"))
    assert isinstance(body, viser.FrameHandle)
    assert isinstance(part, viser.MeshHandle)
    before, plain = body.position.copy(), part.vertices[:, 2].max()
    client.set("exaggerate", 4.0)
    assert client.until(lambda: part.vertices[:, 2].max() < plain)  # squeezed along z
    assert (body.position == before).all()
    client.set("exaggerate", 1.0)
    assert client.until(lambda: part.vertices[:, 2].max() == plain)


def test_a_ghost_and_a_wireframe_appear_and_go(stubbed: Stubbed) -> None:
    app, client = stubbed
    assert not any(node.endswith("ghost") for node in client.nodes)
    client.press("Ghost on or off")
    assert client.until(lambda: "/world/column_0/body/ghost" in client.nodes)
    client.set("wireframe", True)
    part = app.server.scene.get_handle_by_name("/world/column_0/body/part_0")
    assert client.until(lambda: part.wireframe)  # pyright: ignore[reportOptionalMemberAccess, reportAttributeAccessIssue]
