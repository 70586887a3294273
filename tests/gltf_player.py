"""A small glTF 2.0 player: checks what the specification demands of a file, and evaluates its animation."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from odeform.types import Floats

WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
DTYPES = {5126: "<f4", 5125: "<u4"}


class Player:
    """A `.glb` file: `tree` is its JSON, `array(index)` an accessor, `vertices(frame)` the meshes on screen."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        assert data[:4] == b"glTF"
        version, length, size = np.frombuffer(data, "<u4", 3, 4)
        assert version == 2
        assert length == len(data)
        assert data[16:20] == b"JSON"
        assert size % 4 == 0
        self.tree: dict[str, Any] = json.loads(data[20 : 20 + size])
        start = 20 + int(size)
        length = int(np.frombuffer(data, "<u4", 1, start)[0])
        assert data[start + 4 : start + 8] == b"BIN\0"
        assert len(data) == start + 8 + length
        assert self.tree["buffers"] == [{"byteLength": length}]
        self._binary = data[start + 8 :]
        self.check()

    def array(self, index: int) -> Floats:
        accessor = self.tree["accessors"][index]
        view = self.tree["bufferViews"][accessor["bufferView"]]
        kind, width = DTYPES[accessor["componentType"]], WIDTHS[accessor["type"]]
        assert view["byteOffset"] % 4 == 0
        assert view["byteOffset"] + view["byteLength"] <= len(self._binary)
        assert view["byteLength"] == 4 * width * accessor["count"]
        out = np.frombuffer(self._binary, kind, width * accessor["count"], view["byteOffset"]).reshape(-1, width)
        assert np.isfinite(out).all()
        np.testing.assert_array_equal(out.min(axis=0), accessor["min"])
        np.testing.assert_array_equal(out.max(axis=0), accessor["max"])
        return out[:, 0] if width == 1 else out

    def check(self) -> None:
        """Demands of the specification on accessors, meshes, nodes and the animation."""
        tree = self.tree
        assert tree["asset"]["version"] == "2.0"
        arrays = [self.array(index) for index in range(len(tree["accessors"]))]
        for mesh in tree["meshes"]:
            (part,) = mesh["primitives"]
            count = len(arrays[part["attributes"]["POSITION"]])
            assert arrays[part["indices"]].max() < count
            assert np.allclose(np.linalg.norm(arrays[part["attributes"]["NORMAL"]], axis=1), 1.0, atol=5e-4)
            for group in (part["attributes"], *part.get("targets", [])):
                assert all(len(arrays[index]) == count for index in group.values())
            assert len(mesh.get("weights", [])) == len(part.get("targets", []))
        (animation,) = tree["animations"]
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            times, values = arrays[sampler["input"]], arrays[sampler["output"]]
            assert times[0] >= 0.0
            assert (np.diff(times) > 0.0).all()
            targets = len(tree["meshes"][0].get("weights", []))
            assert len(values) == len(times) * (targets if channel["target"]["path"] == "weights" else 1)
            if channel["target"]["path"] == "rotation":
                assert np.allclose(np.linalg.norm(values, axis=1), 1.0, atol=1e-6)
                assert ((values[1:] * values[:-1]).sum(axis=1) >= 0.0).all()

    @property
    def times(self) -> Floats:
        return self.array(self.tree["animations"][0]["samplers"][0]["input"])

    def vertices(self, frame: int, node: int = 1) -> Floats:
        """(N, 3) vertices of the mesh of a node at a keyframe, under the root node: y is up."""
        nodes, animation = self.tree["nodes"], self.tree["animations"][0]
        state = dict(nodes[node])
        part = self.tree["meshes"][state["mesh"]]["primitives"][0]
        points = self.array(part["attributes"]["POSITION"]).astype(float)
        for channel in animation["channels"]:
            values = self.array(animation["samplers"][channel["sampler"]]["output"])
            if channel["target"]["node"] == node:
                state[channel["target"]["path"]] = values.reshape(len(self.times), -1)[frame].astype(float)
        for weight, target in zip(state.get("weights", ()), part.get("targets", ()), strict=True):
            points += weight * self.array(target["POSITION"])
        for moved in (state, nodes[0]):
            turn = Rotation.from_quat(moved.get("rotation", [0.0, 0.0, 0.0, 1.0])).as_matrix()
            points = points @ turn.T + np.asarray(moved.get("translation", np.zeros(3)))
        return points
