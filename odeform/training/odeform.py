"""The training of ODeform from reduced data: its network, its settings, and what a checkpoint keeps of both."""

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from odeform.dataset.training_data import TrainingData
from odeform.models.odeform.model import PREFIX
from odeform.training import config
from odeform.training.ablation import ablate, remove_ablated
from odeform.training.loop import network_weights, train_network
from odeform.training.request import TrainRequest
from odeform.training.start import build_network
from odeform.types import Arrays

__all__ = ["fit_odeform"]


def fit_odeform(
    data: TrainingData, request: TrainRequest, report: Callable[[str], None], part: Path
) -> tuple[Arrays, dict[str, Any]]:
    """Arrays and settings of the checkpoint."""
    net = build_network(data, request.seed)
    ablate(net, request.without)
    used = config.TrainConfig(request.minutes, request.steps, seed=request.seed, without=request.without)
    if "random-features" in request.without:
        used = replace(used, random_features=0)
    val = train_network(net, data, used, report, part, request.resume)
    remove_ablated(net)
    settings = {"network": asdict(net.config), "qualities": {}, "training": asdict(used), "val": val}
    return {PREFIX + name: value for name, value in network_weights(net).items()}, settings
