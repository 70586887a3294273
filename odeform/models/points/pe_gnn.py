"""`pe-gnn`: a graph network of the final state, after Saleh et al. 2024 (physics-encoded graph neural networks for
deformation prediction under contact), on PyTorch Geometric.

Physical parameters and the contact are features of the nodes. The paper's network reads object and probe as graphs of
their own; here the contact and its force stand for the probe, as these scenes give them.
"""

import time
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from odeform.arrays import STEP
from odeform.checkpoint import Checkpoint
from odeform.errors import InputError
from odeform.models.points.node_graph import NodeGraph
from odeform.models.points.point_model import PREFIX, PointPredictor, frame_from_json
from odeform.motion.base import SolveStats
from odeform.motion.point_motion import MeanMotion
from odeform.schema import Parameters, Window
from odeform.types import Floats, Frames, MotionSequence, Times

if TYPE_CHECKING:
    from odeform.models.points.graph_network import GraphNetwork
    from odeform.models.training.run import Run

__all__ = ["PeGnn", "new_network"]


def new_network(features: int, width: int, layers: int) -> "GraphNetwork":
    """Builds an untrained network. Raises `InputError` without the extra `gnn`."""
    try:
        from odeform.models.points.graph_network import GraphNetwork
    except ModuleNotFoundError:
        raise InputError("pe-gnn: expected PyTorch Geometric: pip install 'odeform[gnn]'") from None
    return GraphNetwork(features, width, layers)


class FinalState:
    """Displacements of N points at the end of the window, for every time after the start."""

    def __init__(self, moved: Floats, window: Window, wall_ms: float) -> None:
        """`moved` (N, 3) metres, canonical."""
        self._moved, self._window, self._wall_ms = moved.astype(np.float32), window, wall_ms

    def stats(self) -> SolveStats:
        """No solver and no steps."""
        solver = f"final state only, at t = {self._window.stop:.3g} s"
        return SolveStats(solver, 0, 0, 0, "ok", self._wall_ms, lambda: None)

    def displacements(self, times: Times) -> Frames:
        """(T,) seconds -> (T, N, 3) metres, canonical; zero at the start."""
        return self._moved * (times > self._window.start).astype(np.float32)[:, None, None]


class PeGnn(PointPredictor):
    """Predicts where a body is at the end of the window. At any other time that state is shown, and said to be it."""

    model = "pe-gnn"
    extrapolates = False
    final_only = True

    @classmethod
    def train(cls, run: "Run") -> Checkpoint:
        from odeform.models.points.training.graphs import train_graphs

        return train_graphs(run)

    def _read(self, checkpoint: Checkpoint) -> None:
        import torch

        config, arrays = checkpoint.config, checkpoint.arrays
        self.frame = frame_from_json(config["frame"])
        self._graph = NodeGraph(arrays["nodes"], self.frame)
        features = self._graph.features(self.schema, np.zeros((1, len(self.schema.learned)))).shape[2]
        self._network = new_network(features, config["width"], config["layers"])
        stored = {k: v for k, v in arrays.items() if k.startswith(PREFIX) and not k.endswith(STEP)}
        weights = {k.removeprefix(PREFIX): torch.tensor(v) for k, v in stored.items()}
        if not all(torch.isfinite(weight).all() for weight in weights.values()):
            raise ValueError("weights: expected finite numbers")
        self._network.load_state_dict(weights)
        self._network.eval()
        self.mean = MeanMotion(np.array([0.0, self.schema.window.stop]), np.zeros((2, 3)))

    def _nodes_moved(self, parameters: Parameters) -> Floats:
        """(M, 3) metres, canonical."""
        import torch

        graph = self._graph
        features = graph.features(self.schema, np.asarray(self.schema.inputs(parameters))[None])[0]
        with torch.no_grad():
            moved = self._network(*(torch.from_numpy(a) for a in (features, graph.edges, graph.along)))
        return moved.numpy().astype(float) * self.frame.scale

    def _trajectories(
        self, bodies: Sequence[Floats], parameters: Parameters, observed: MotionSequence | None
    ) -> Iterator[FinalState]:
        begin = time.perf_counter()
        moved = self._nodes_moved(parameters)
        wall_ms, window = 1e3 * (time.perf_counter() - begin), self.schema.window
        inputs = (self.frame.inputs(points) for points in bodies)
        return (FinalState(self._graph.interpolated(moved, body), window, wall_ms) for body in inputs)
