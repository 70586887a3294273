"""The theme: each client has its own."""

from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App


def test_a_theme_is_of_one_client_with_its_floor(kicked: tuple[App, LoopbackClient], port: int) -> None:
    _, one = kicked
    with LoopbackClient(port) as two:
        for client, command, dark in ((one, "Dark theme", True), (two, "Light theme", False)):
            client.press(command)
            messages: list[dict] = []
            while not any(m["type"] == "SceneNodeUpdateMessage" and "plane_color" in m["updates"] for m in messages):
                messages += client.receive(10.0) or []
            (theme,) = (m for m in messages if m["type"] == "ThemeConfigurationMessage")
            assert theme["dark_mode"] is dark
