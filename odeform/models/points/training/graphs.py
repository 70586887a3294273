"""Training of the graph network that predicts final states."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from scipy.spatial import KDTree

from odeform.checkpoint import Checkpoint
from odeform.dataset.subsampling import FrameSubsampling
from odeform.models.points.node_graph import NodeGraph
from odeform.models.points.pe_gnn import PeGnn, new_network
from odeform.models.points.point_model import PREFIX, frame_to_json
from odeform.models.points.training.fit import CLIP, VALIDATIONS, Budget
from odeform.models.points.training.point_data import PointData, prepare_points
from odeform.models.training.descent import cosine_decay, small_batches
from odeform.models.training.run import Run
from odeform.motion.point_motion import evaluate_probes
from odeform.types import Floats, Mesh

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

    def __init__(self, graph: NodeGraph, features: int, config: GraphConfig, seed: int) -> None:
        torch.manual_seed(seed)
        # not within `small_batches`: k-d trees need denormal numbers
        self._edges, self._along = torch.from_numpy(graph.edges), torch.from_numpy(graph.along)
        self.network = new_network(features, config.width, config.layers)
        self.optimiser = torch.optim.Adam(self.network.parameters(), lr=config.rate)

    def predict(self, features: torch.Tensor) -> torch.Tensor:
        """(B, M, features) -> (B, M, 3)."""
        bodies, nodes, _ = features.shape
        steps = nodes * torch.arange(bodies)
        edges = (self._edges[:, None] + steps[None, :, None]).flatten(1)
        along = self._along.repeat(bodies, 1)
        return self.network(features.flatten(0, 1), edges, along).reshape(bodies, nodes, 3)

    def step(self, data: _Split, chosen: torch.Tensor) -> float:
        """One step of descent on the sequences `chosen`; returns the loss."""
        self.optimiser.zero_grad()
        loss = (self.predict(data.features[chosen]) - data.moved[chosen]).square().mean()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), CLIP)
        self.optimiser.step()
        return float(loss.detach())

    @torch.no_grad()
    def error(self, data: _Split, batch: int) -> float:
        """RMSE in units of the frame's scale."""
        parts = zip(data.features.split(batch), data.moved.split(batch), strict=True)
        squares = [(self.predict(features) - moved).square().mean(dim=(1, 2)) for features, moved in parts]
        return float(torch.cat(squares).mean().sqrt())


def fit_graphs(data: PointData, rest: Mesh, budget: Budget, seed: int, report: Callable[[str], None]) -> Checkpoint:
    """The checkpoint of `pe-gnn`, without the body that viewers show. `rest` is the body of the data, N vertices."""
    config = GraphConfig()
    graph, splits = _prepared(data, rest, config.nodes)
    learner = _Learner(graph, splits["train"].features.shape[2], config, seed)
    generator = torch.Generator().manual_seed(seed + 1)
    begin, done, fraction, validated = time.process_time(), 0, 0.0, 0
    best: tuple[float, dict[str, Any]] = (math.inf, {})
    with small_batches():
        while fraction < 1.0:
            learner.optimiser.param_groups[0]["lr"] = config.rate * cosine_decay(fraction)
            chosen = torch.randint(0, len(splits["train"].moved), (config.batch,), generator=generator)
            loss = learner.step(splits["train"], chosen)
            done += 1
            spent = time.process_time() - begin
            fraction = done / budget.steps if budget.steps is not None else spent / budget.seconds
            if fraction >= 1.0 or fraction * VALIDATIONS >= validated + 1:
                validated = int(fraction * VALIDATIONS)
                error = 1e3 * graph.frame.scale * learner.error(splits["val"], config.batch)
                report(f"{100 * fraction:.0f} %, step {done}: loss {loss:.3g}, {error:.3f} mm (val)")
                if error < best[0]:
                    best = error, {k: v.numpy().copy() for k, v in learner.network.state_dict().items()}
    settings = {"width": config.width, "layers": config.layers, "frame": frame_to_json(graph.frame)}
    val = {"val_rmse_mm": best[0], "steps": done, "seconds": time.process_time() - begin}
    arrays = {"nodes": graph.nodes, **{PREFIX + name: weight for name, weight in best[1].items()}}
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
