"""Arrows that show the parameters of a scene, as the scene itself describes them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import viser
from jaxtyping import Int

from odeform.loads.arrow import Arrow
from odeform.simulation.scenes.registry import find_scene
from odeform.types import Points, Pose, Vector
from odeform_viz.colors import ACTING

__all__ = ["GlyphView"]

CARRIERS = 6  # points of a body that hold an end of an arrow
SHORTEST = 0.3  # of the length at full strength; it shows where a force acts that has just begun


class GlyphView:
    """The arrows of one body and their labels. Scenes that cannot be simulated have none."""

    def __init__(self, server: viser.ViserServer, root: str, rest: Points) -> None:
        """`rest` (N, 3) m are the points of the body at rest, under the scene node `root`."""
        self._server, self._root, self._rest = server, root, rest
        self._extent = float(np.ptp(rest, axis=0).max())
        self._of: tuple[str, Mapping[str, float]] | None = None
        self._arrows: tuple[_Attached, ...] = ()
        self._shafts: viser.ArrowsHandle | None = None
        self._labels: list[viser.LabelHandle] = []

    def show(
        self, scene: str, parameters: Mapping[str, float], time: float, points: Points, pose: Pose, labels: bool = True
    ) -> None:
        """Show the arrows of a scene that act at `time` s, as strong as they are then, with `labels` of how strong.

        Parameters are in the units of its schema. Arrows touch the body, whose points (N, 3) m `pose` (4, 4) moves.
        """
        if self._of != (scene, parameters):
            known = find_scene(scene)
            self._of = (scene, parameters)
            arrows = known.glyphs(parameters, self._rest) if known is not None else ()
            self._arrows = tuple(_Attached.to(self._rest, arrow) for arrow in arrows)
        acting = [each for each in self._arrows if each.arrow.begin <= time <= each.arrow.end]
        self._show_shafts([each.placed(time, points, pose) for each in acting])
        labelled = acting if labels else []
        while len(self._labels) > len(labelled):
            self._labels.pop().remove()
        for index, each in enumerate(labelled):
            self._show_label(index, each, each.free_end(time, points, pose), each.label(time))

    def _show_shafts(self, arrows: Sequence[tuple[Vector, Vector]]) -> None:
        if not arrows:
            if self._shafts is not None:
                self._shafts.remove()
                self._shafts = None
            return
        ends = np.array(arrows, dtype=np.float32)
        if self._shafts is not None and np.array_equal(self._shafts.points, ends):
            return
        # a short arrow has a short head
        shortest = min(float(np.linalg.norm(head - tail)) for tail, head in arrows)
        self._shafts = self._server.scene.add_arrows(
            f"{self._root}/arrows",
            ends,
            ACTING,
            shaft_radius=0.02 * self._extent,
            head_radius=0.055 * self._extent,
            head_length=min(0.12 * self._extent, 0.6 * shortest),
        )

    def _show_label(self, index: int, of: "_Attached", position: Vector, text: str) -> None:
        if index == len(self._labels):
            name, anchor = f"{self._root}/arrow_label_{index}", "center-left" if of.arrow.leaves else "top-center"
            self._labels.append(self._server.scene.add_label(name, text, position=position, anchor=anchor))
        else:
            self._labels[index].position = position
            if self._labels[index].text != text:
                self._labels[index].text = text


@dataclass(frozen=True, eq=False)
class _Attached:
    """An arrow that ends at the points of a body that are nearest to its head, or leaves the middle of all."""

    arrow: Arrow
    carriers: Int[np.ndarray, " carriers"]
    offset: Vector
    """(3,) m from their mean to that end, at rest."""

    @classmethod
    def to(cls, rest: Points, arrow: Arrow) -> "_Attached":
        if arrow.leaves:  # given where a motion begins, which may be turned and in the air
            return cls(arrow, np.arange(len(rest)), np.zeros(3))
        if arrow.vertex is not None:
            return cls(arrow, np.array([arrow.vertex]), np.zeros(3))
        end = np.asarray(arrow.start + arrow.vector, dtype=float)
        carriers = np.argpartition(np.linalg.norm(rest - end, axis=1), min(CARRIERS, len(rest)) - 1)[:CARRIERS]
        return cls(arrow, carriers, end - rest[carriers].mean(axis=0))

    def placed(self, time: float, points: Points, pose: Pose) -> tuple[Vector, Vector]:
        """Tail and head (3,) m at `time` s. An arrow that leaves the body is seen from where it comes out of it."""
        end = pose[:3, :3] @ (points[self.carriers].mean(axis=0) + self.offset) + pose[:3, 3]
        vector = max(self.arrow.strength(time), SHORTEST) * self.arrow.vector
        if not self.arrow.leaves:
            return end - vector, end
        along = vector / np.linalg.norm(vector)
        out = end + float((points @ pose[:3, :3].T + pose[:3, 3] - end).dot(along).max()) * along
        return out, out + vector

    def free_end(self, time: float, points: Points, pose: Pose) -> Vector:
        """(3,) m: the end that is away from the body."""
        return self.placed(time, points, pose)[1 if self.arrow.leaves else 0]

    def label(self, time: float) -> str:
        """The strength now, and the largest."""
        share = self.arrow.strength(time)
        if share > 0.995:
            return self.arrow.label
        value, _, _ = self.arrow.label.partition(" ")
        return f"{share * float(value):.3g} of {self.arrow.label}"
