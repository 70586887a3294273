"""The arrows that a scene describes are drawn, and only these."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
import viser

from odeform.loads.arrow import Arrow
from odeform.simulation.scenes import kick
from odeform.types import Points
from odeform_viz.rendering import glyphs
from odeform_viz.rendering.glyphs import GlyphView

REST = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.1]], dtype=np.float32)


@pytest.fixture
def view(server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch) -> GlyphView:
    """Of a scene with `count` arrows of `wind` m each; no other scene is known."""

    def arrows(parameters: Mapping[str, float], rest: Points) -> tuple[Arrow, ...]:
        wind, x = parameters["wind"], np.array([1.0, 0.0, 0.0])
        return tuple(
            Arrow(rest[0] + index * x, wind * x, f"{wind:g} m", 0.0, 1.0) for index in range(int(parameters["count"]))
        )

    toy = replace(kick.SCENE, glyphs=arrows)
    monkeypatch.setattr(glyphs, "find_scene", lambda name: toy if name == "toy" else None)
    return GlyphView(server, "/body", REST)


def _labels(server: viser.ViserServer) -> list[str]:
    nodes = [server.scene.get_handle_by_name(f"/body/arrow_label_{index}") for index in range(4)]
    return [node.text for node in nodes if isinstance(node, viser.LabelHandle)]


def test_arrows_and_labels_follow_the_parameters(view: GlyphView, server: viser.ViserServer) -> None:
    view.show("toy", {"wind": 2.0, "count": 2}, 0.5, REST, np.eye(4))
    node = server.scene.get_handle_by_name("/body/arrows")
    assert isinstance(node, viser.ArrowsHandle)
    np.testing.assert_allclose(node.points, [[[0, 0, 0], [2, 0, 0]], [[1, 0, 0], [3, 0, 0]]])
    assert _labels(server) == ["2 m", "2 m"]
    view.show("toy", {"wind": 3.0, "count": 1}, 0.5, REST, np.eye(4))
    assert _labels(server) == ["3 m"]
    label = server.scene.get_handle_by_name("/body/arrow_label_0")
    assert label is not None
    np.testing.assert_allclose(label.position, [0.0, 0.0, 0.0])


@pytest.mark.parametrize(("scene", "count"), [("toy", 0), ("imported", 2)])
def test_scenes_without_arrows_show_none(view: GlyphView, server: viser.ViserServer, scene: str, count: int) -> None:
    view.show("toy", {"wind": 2.0, "count": 2}, 0.5, REST, np.eye(4))
    view.show(scene, {"wind": 2.0, "count": count}, 0.5, REST, np.eye(4))
    assert server.scene.get_handle_by_name("/body/arrows") is None
    assert _labels(server) == []


def test_an_arrow_goes_when_its_cause_ends(view: GlyphView, server: viser.ViserServer) -> None:
    for time, count in ((0.0, 1), (1.0, 1), (1.01, 0), (0.5, 1)):
        view.show("toy", {"wind": 2.0, "count": 1}, time, REST, np.eye(4))
        assert len(_labels(server)) == count
        assert (server.scene.get_handle_by_name("/body/arrows") is not None) == bool(count)


def test_an_arrow_touches_the_body_and_is_as_strong_as_its_cause_is_then(
    server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    x = np.array([1.0, 0.0, 0.0])
    toy = replace(kick.SCENE, glyphs=lambda *_: (Arrow(-2.0 * x, 2.0 * x, "8 N", 0.0, 1.0, rises=True),))
    monkeypatch.setattr(glyphs, "find_scene", lambda _: toy)
    view, pose = GlyphView(server, "/body", REST), np.eye(4)
    pose[:3, 3] = [0.0, 5.0, 0.0]
    dented = REST + np.array([0.01, 0.0, 0.0], np.float32)
    for time, length, label in ((0.5, 2.0, "8 N"), (0.25, 1.0, "4 of 8 N"), (0.0, 0.6, "0 of 8 N")):
        view.show("toy", {}, time, dented, pose)
        node = server.scene.get_handle_by_name("/body/arrows")
        assert isinstance(node, viser.ArrowsHandle)
        np.testing.assert_allclose(node.points[0], [[0.01 - length, 5.0, 0.0], [0.01, 5.0, 0.0]], atol=1e-6)
        assert _labels(server) == [label]


def test_a_velocity_leaves_a_body_that_begins_turned(
    server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    x = np.array([1.0, 0.0, 0.0])
    middle = REST.mean(axis=0).astype(float)
    toy = replace(kick.SCENE, glyphs=lambda *_: (Arrow(middle + 2.0 * x, x, "1 m/s", 0.0, 1.0, leaves=True),))
    monkeypatch.setattr(glyphs, "find_scene", lambda _: toy)
    view, pose = GlyphView(server, "/body", REST), np.eye(4)
    pose[:3, :3] = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]
    pose[:3, 3] = [0.0, 0.0, 2.0]
    view.show("toy", {}, 0.0, REST, pose)
    node = server.scene.get_handle_by_name("/body/arrows")
    assert isinstance(node, viser.ArrowsHandle)
    start = pose[:3, :3] @ middle + pose[:3, 3]
    start[0] = (REST @ pose[:3, :3].T)[:, 0].max()  # where the body ends along it
    np.testing.assert_allclose(node.points[0], [start, start + x], atol=1e-6)
    view.show("toy", {}, 0.0, REST, pose, labels=False)
    assert _labels(server) == []
