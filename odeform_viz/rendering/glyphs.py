"""Arrows that show the parameters of a scene, as the scene itself describes them."""

from collections.abc import Mapping

import numpy as np
import viser

from odeform.simulation.glyphs import Arrow
from odeform.simulation.scenes.registry import find_scene
from odeform.types import Points
from odeform_viz.colors import ACTING

__all__ = ["GlyphView"]


class GlyphView:
    """The arrows of one body and their labels. Scenes that cannot be simulated have none."""

    def __init__(self, server: viser.ViserServer, root: str, rest: Points) -> None:
        """`rest` (N, 3) m are the points of the body at rest, under the scene node `root`."""
        self._server, self._root, self._rest = server, root, rest
        self._extent = float(np.ptp(rest, axis=0).max())
        self._of: tuple[str, Mapping[str, float]] | None = None
        self._arrows: tuple[Arrow, ...] = ()
        self._shown: tuple[Arrow, ...] | None = None
        self._shafts: viser.ArrowsHandle | None = None
        self._labels: list[viser.LabelHandle] = []

    def show(self, scene: str, parameters: Mapping[str, float], time: float) -> None:
        """Show the arrows of a scene that act at `time` s; parameters are in the units of its schema."""
        if self._of != (scene, parameters):
            known = find_scene(scene)
            self._of, self._shown = (scene, parameters), None
            self._arrows = known.glyphs(parameters, self._rest) if known is not None else ()
        arrows = tuple(arrow for arrow in self._arrows if arrow.begin <= time <= arrow.end)
        if arrows == self._shown:
            return
        self._shown = arrows
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
        # a short arrow has a short head
        shortest = min(float(np.linalg.norm(arrow.vector)) for arrow in arrows)
        self._shafts = self._server.scene.add_arrows(
            f"{self._root}/arrows",
            np.array([[arrow.start, arrow.start + arrow.vector] for arrow in arrows], dtype=np.float32),
            ACTING,
            shaft_radius=0.02 * self._extent,
            head_radius=0.055 * self._extent,
            head_length=min(0.12 * self._extent, 0.6 * shortest),
        )

    def _show_label(self, index: int, arrow: Arrow) -> None:
        tail = np.asarray(arrow.start, dtype=float)
        if index == len(self._labels):
            name = f"{self._root}/arrow_label_{index}"
            label = self._server.scene.add_label(name, arrow.label, position=tail, anchor="top-right")
            self._labels.append(label)
        else:
            self._labels[index].position = tail
            if self._labels[index].text != arrow.label:
                self._labels[index].text = arrow.label
