"""Training of the graph network that predicts final states."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import torch
from scipy.spatial import KDTree

from odeform.checkpoint import Checkpoint
from odeform.dataset.subsampling import FrameSubsampling
from odeform.models.points.node_graph import NodeGraph
from odeform.models.points.pe_gnn import PeGnn, new_network
from odeform.models.points.point_model import PREFIX, frame_to_json, weights_in_steps
from odeform.models.points.training.learner import CLIP
from odeform.models.points.training.point_data import PointData, prepare_points
from odeform.models.training.descent import Budget, cosine_decay, descend, small_batches
from odeform.models.training.run import Run
from odeform.motion.point_motion import evaluate_probes
from odeform.types import Arrays, Floats, Mesh

__all__ = ["GraphConfig", "fit_graphs", "train_graphs"]


@dataclass(frozen=True)
class GraphConfig:
    """Settings of the network and its training, the same for all bodies."""

    nodes: int = 256
    """Vertices that are nodes, spread over the body; the others are interpolated."""
    width: int = 64
    layers: int = 4
    rate: float = 2e-3
    """Learning rate, decaying to 0 along a cosine."""
    batch: int = 8
    """Sequences in a step."""


@dataclass(frozen=True, eq=False)
class _Split:
    features: torch.Tensor  # (S, M, features)
    moved: torch.Tensor  # (S, M, 3) displacements in units of the frame's scale


class _Learner:
    """The network, its graph repeated for a batch, and its optimiser."""

    def __init__(self, graph: NodeGraph, splits: dict[str, _Split], config: GraphConfig, seed: int) -> None:
        torch.manual_seed(seed)
        # not within `small_batches`: k-d trees need denormal numbers
        self._edges, self._along = torch.from_numpy(graph.edges), torch.from_numpy(graph.along)
        self.config, self.splits, self.scale_mm = config, splits, 1e3 * graph.frame.scale
        self.network = new_network(splits["train"].features.shape[2], config.width, config.layers)
        self.generator = torch.Generator().manual_seed(seed + 1)
        self.best: tuple[float, Arrays] = (math.inf, {})
        self.done, self.elapsed = 0, 0.0
        self.optimiser = torch.optim.Adam(self.network.parameters(), lr=config.rate)

    def predict(self, features: torch.Tensor) -> torch.Tensor:
        """(B, M, features) -> (B, M, 3)."""
        bodies, nodes, _ = features.shape
        steps = nodes * torch.arange(bodies)
        edges = (self._edges[:, None] + steps[None, :, None]).flatten(1)
        along = self._along.repeat(bodies, 1)
        return self.network(features.flatten(0, 1), edges, along).reshape(bodies, nodes, 3)

    def advance(self, fraction: float) -> float:
        """One step of descent at this fraction of the length; returns the loss."""
        self.optimiser.param_groups[0]["lr"] = self.config.rate * cosine_decay(fraction)
        data = self.splits["train"]
        chosen = torch.randint(0, len(data.moved), (self.config.batch,), generator=self.generator)
        self.optimiser.zero_grad()
        loss = (self.predict(data.features[chosen]) - data.moved[chosen]).square().mean()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), CLIP)
        self.optimiser.step()
        self.done += 1
        return float(loss.detach())

    @torch.no_grad()
    def validate(self) -> float:
        """RMSE in mm on validation; keeps the weights if they are the best so far."""
        val, batch = self.splits["val"], self.config.batch
        parts = zip(val.features.split(batch), val.moved.split(batch), strict=True)
        squares = [(self.predict(features) - moved).square().mean(dim=(1, 2)) for features, moved in parts]
        error = self.scale_mm * float(torch.cat(squares).mean().sqrt())
        if error < self.best[0]:
            self.best = error, {name: weight.numpy().copy() for name, weight in self.network.state_dict().items()}
        return error


def fit_graphs(data: PointData, rest: Mesh, budget: Budget, seed: int, report: Callable[[str], None]) -> Checkpoint:
    """The checkpoint of `pe-gnn`, without the body that viewers show. `rest` is the body of the data, N vertices."""
    config = GraphConfig()
    graph, splits = _prepared(data, rest, config.nodes)
    learner = _Learner(graph, splits, config, seed)
    with small_batches():
        descend(learner, budget, report)
    settings = {"width": config.width, "layers": config.layers, "frame": frame_to_json(graph.frame)}
    val = {"val_rmse_mm": learner.best[0], "steps": learner.done, "seconds": learner.elapsed}
    weights = weights_in_steps({PREFIX + name: weight for name, weight in learner.best[1].items()})
    arrays = {"nodes": graph.nodes, **weights}
    return Checkpoint(PeGnn.model, data.schema, {**settings, "val": val}, arrays)


def _prepared(data: PointData, rest: Mesh, count: int) -> tuple[NodeGraph, dict[str, _Split]]:
    """The graph of the body, and features and final displacements of its nodes."""
    x = data.x.astype(float) * data.frame.gyration_radius
    probes = evaluate_probes(Mesh((x + np.array(data.frame.anchor)), rest.faces), np.array(data.frame.anchor), count)
    chosen = KDTree(x).query(probes.points)[1]
    final = {split: data.moved[split][:, -1] * data.frame.scale + data.mean.shifts[-1] for split in data.moved}
    scale = float(np.sqrt((final["train"] ** 2).mean())) or 1.0
    graph = NodeGraph(data.x[chosen], replace(data.frame, scale=scale))

    def split(name: str) -> _Split:
        moved: Floats = (final[name][:, chosen] / scale).astype(np.float32)
        features = graph.features(data.schema, data.theta[name])
        return _Split(torch.from_numpy(features), torch.from_numpy(moved))

    return graph, {name: split(name) for name in data.moved}


def train_graphs(run: Run) -> Checkpoint:
    """Train `pe-gnn` on the last frames of the data of `run`."""
    request = run.request
    data = prepare_points(run.dataset, FrameSubsampling(request.window))
    run.report(f"{request.model} on the last frames of {len(data.theta['train'])} sequences")
    rest = next(run.dataset.sequences("train")).rest
    checkpoint = fit_graphs(data, rest, Budget(60.0 * request.minutes, request.steps), request.seed, run.report)
    return replace(checkpoint, arrays=run.with_body(checkpoint.arrays, data.theta["train"]))
