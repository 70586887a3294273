"""Arrows that show the parameters of a scene, as the scene itself describes them."""

from collections.abc import Mapping

import numpy as np
import viser

from odeform.simulation.glyphs import Arrow
from odeform.simulation.scenes.registry import find_scene
from odeform.types import Points
from odeform_viz.colors import ARROW

__all__ = ["GlyphView"]


class GlyphView:
    """The arrows of one body and their labels. Scenes that cannot be simulated have none."""

    def __init__(self, server: viser.ViserServer, root: str, rest: Points) -> None:
        """`rest` (N, 3) m are the points of the body at rest, under the scene node `root`."""
        self._server, self._root, self._rest = server, root, rest
        self._extent = float(np.ptp(rest, axis=0).max())
        self._shafts: viser.ArrowsHandle | None = None
        self._labels: list[viser.LabelHandle] = []

    def show(self, scene: str, parameters: Mapping[str, float]) -> None:
        """Show the arrows of a scene for these parameters, in the units of its schema."""
        known = find_scene(scene)
        arrows = known.glyphs(parameters, self._rest) if known is not None else ()
        self._show_shafts(arrows)
        while len(self._labels) > len(arrows):
            self._labels.pop().remove()
        for index, arrow in enumerate(arrows):
            self._show_label(index, arrow)

    def _show_shafts(self, arrows: tuple[Arrow, ...]) -> None:
        if not arrows:
            if self._shafts is not None:
                self._shafts.remove()
                self._shafts = None
            return
        self._shafts = self._server.scene.add_arrows(
            f"{self._root}/arrows",
            np.array([[arrow.start, arrow.start + arrow.vector] for arrow in arrows], dtype=np.float32),
            ARROW,
            shaft_radius=0.02 * self._extent,
            head_radius=0.055 * self._extent,
            head_length=0.12 * self._extent,
        )

    def _show_label(self, index: int, arrow: Arrow) -> None:
        tip = np.asarray(arrow.start + arrow.vector, dtype=float)
        if index == len(self._labels):
            name = f"{self._root}/arrow_label_{index}"
            label = self._server.scene.add_label(name, arrow.label, position=tip, anchor="bottom-left")
            self._labels.append(label)
        else:
            self._labels[index].position = tip
            if self._labels[index].text != arrow.label:
                self._labels[index].text = arrow.label
