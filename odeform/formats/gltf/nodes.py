"""The scene graph: which meshes are placed where.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html, section 3.5, and the extension EXT_mesh_gpu_instancing.
"""

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.errors import InputError
from odeform.formats.gltf.accessors import read_floats
from odeform.formats.gltf.document import Document, Tree
from odeform.types import Floats

__all__ = ["INSTANCES", "Scene"]

INSTANCES = 100_000


class Scene:
    """The nodes of the default scene, with their places in the world.

    Attributes:
        world: (4, 4) by the index of each node of the scene.
    """

    def __init__(self, document: Document) -> None:
        self._document, self._nodes = document, document.items("nodes")
        self.world: dict[int, Floats] = {}
        self._hidden: set[int] = set()
        self._walk()

    def placed(self) -> Iterator[tuple[Tree, Tree, NDArray[np.float64]]]:
        """Lists node, mesh and the places (K, 4, 4) of its copies, of each node with a mesh."""
        document, total = self._document, 0
        for index, matrix in self.world.items():
            node = self._nodes[index]
            if "mesh" not in node or index in self._hidden:
                continue
            copies = self._copies(node)
            total += len(copies)
            if total > INSTANCES:
                raise InputError(
                    f"{document.where}: expected at most {INSTANCES:,} placed meshes, got {total:,} or more"
                )
            yield node, document.item("meshes", node["mesh"]), matrix @ copies

    def joints(self, node: Tree) -> Floats | None:
        """(J, 4, 4) from the pose at which a mesh was bound to its bones to the pose of the nodes; None without."""
        if "skin" not in node:
            return None
        document = self._document
        skin = document.item("skins", node["skin"])
        joints = skin.get("joints")
        if not isinstance(joints, list) or not all(isinstance(j, int) and j in self._everywhere for j in joints):
            raise InputError(f"{document.where}: skin: expected joints that are nodes")
        matrices = np.array([self._everywhere[joint] for joint in joints]).reshape(-1, 4, 4)
        if "inverseBindMatrices" in skin:
            inverse = read_floats(document, skin["inverseBindMatrices"], 16)
            if len(inverse) < len(joints):
                raise InputError(f"{document.where}: skin: expected {len(joints)} matrices, got {len(inverse)}")
            # stored by columns
            matrices = matrices @ inverse[: len(joints)].reshape(-1, 4, 4).swapaxes(1, 2)
        return matrices

    @cached_property
    def _everywhere(self) -> dict[int, Floats]:
        """The places of all nodes: bones may lie outside of the default scene."""
        rest = {index: np.eye(4) for index in range(len(self._nodes)) if index not in self._children_of_any}
        return {**self._descend(rest, set()), **self.world}

    @cached_property
    def _children_of_any(self) -> set[int]:
        return {child for node in self._nodes for child in self._children(node)}

    def _children(self, node: Tree) -> list[int]:
        children = node.get("children", [])
        if not isinstance(children, list):
            raise InputError(f"{self._document.where}: expected children to be a list")
        for child in children:
            self._document.item("nodes", child)
        return children

    def _walk(self) -> None:
        document = self._document
        scenes = document.items("scenes")
        if scenes:
            index = document.tree.get("scene", 0)
            roots = document.item("scenes", index).get("nodes", [])
            if len(scenes) > 1:
                document.note(f"{len(scenes) - 1} of {len(scenes)} scenes left out: the default one is read")
        else:
            roots = [index for index in range(len(self._nodes)) if index not in self._children_of_any]
        if not isinstance(roots, list):
            raise InputError(f"{document.where}: expected the nodes of a scene to be a list")
        for root in roots:
            document.item("nodes", root)
        self.world = self._descend({root: np.eye(4) for root in roots}, self._hidden)

    def _descend(self, roots: Mapping[int, Floats], hidden: set[int]) -> dict[int, Floats]:
        """The places of `roots`, whose parents are at the given ones, and of all nodes below them."""
        out: dict[int, Floats] = {}
        waiting = [(index, matrix, False) for index, matrix in reversed([*roots.items()])]
        while waiting:
            index, parent, unseen = waiting.pop()
            if index in out:
                raise InputError(f"{self._document.where}: node {index} has two parents, or is below itself")
            node = self._nodes[index]
            visibility = self._document.extension(node, "KHR_node_visibility")
            unseen = unseen or (visibility is not None and visibility.get("visible") is False)
            if unseen:
                hidden.add(index)
            out[index] = parent @ self._local(node)
            waiting += [(child, out[index], unseen) for child in reversed(self._children(node))]
        return out

    def _local(self, node: Tree) -> Floats:
        if "matrix" in node:
            return self._numbers(node, "matrix", np.eye(4).ravel()).reshape(4, 4).T
        shifts, turns, scales = (
            self._numbers(node, name, default)[None]
            for name, default in (("translation", (0, 0, 0)), ("rotation", (0, 0, 0, 1)), ("scale", (1, 1, 1)))
        )
        return _placed(shifts, turns, scales)[0]

    def _numbers(self, node: Tree, name: str, default: Any) -> Floats:
        values = node.get(name, default)
        try:
            numbers = np.asarray(values, dtype=float)
        except (TypeError, ValueError):
            numbers = np.zeros(0)
        if numbers.shape != np.shape(default) or not np.isfinite(numbers).all():
            raise InputError(f"{self._document.where}: node: {name}: expected {len(default)} numbers, got {values!r}")
        return numbers

    def _copies(self, node: Tree) -> Floats:
        """(K, 4, 4) places of the copies of a node's mesh, relative to the node."""
        document = self._document
        instancing = document.extension(node, "EXT_mesh_gpu_instancing")
        attributes = instancing.get("attributes") if instancing else None
        if not isinstance(attributes, dict) or not attributes:
            return np.eye(4)[None]
        found = {
            name: read_floats(document, attributes[name], width)
            for name, width in (("TRANSLATION", 3), ("ROTATION", 4), ("SCALE", 3))
            if name in attributes
        }
        counts = {len(values) for values in found.values()}
        if len(counts) != 1:
            raise InputError(
                f"{document.where}: EXT_mesh_gpu_instancing: expected as many shifts, rotations and scales"
            )
        count = counts.pop()
        if count > INSTANCES:
            raise InputError(f"{document.where}: expected at most {INSTANCES:,} placed meshes, got {count:,} or more")
        return _placed(
            found.get("TRANSLATION", np.zeros((count, 3))),
            found.get("ROTATION", np.tile((0.0, 0.0, 0.0, 1.0), (count, 1))),
            found.get("SCALE", np.ones((count, 3))),
        )


def _placed(shifts: Floats, turns: Floats, scales: Floats) -> Floats:
    """(K, 3) shifts, (K, 4) quaternions with w last, (K, 3) scales -> (K, 4, 4)."""
    from scipy.spatial.transform import Rotation

    length = np.linalg.norm(turns, axis=1, keepdims=True)
    turns = np.where(length > 1e-12, turns, (0.0, 0.0, 0.0, 1.0))
    out = np.tile(np.eye(4), (len(shifts), 1, 1))
    out[:, :3, :3] = Rotation.from_quat(turns).as_matrix() * scales[:, None, :]
    out[:, :3, 3] = shifts
    return out
