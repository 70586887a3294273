"""The training of the latent neural ODEs: network, residual, modes, solver settings and continuation, in this order."""

from dataclasses import asdict, replace

from odeform.checkpoint import Checkpoint
from odeform.dataset.training_data import TrainingData
from odeform.models.latent.model import PREFIX, LatentModel
from odeform.models.latent.training import config
from odeform.models.latent.training.ablation import ablate, remove_ablated
from odeform.models.latent.training.loop import network_weights, train_network
from odeform.models.latent.training.start import build_network
from odeform.models.training.continuation import with_continuation
from odeform.models.training.pruning import without_modes
from odeform.models.training.qualities import Validation, with_qualities
from odeform.models.training.residual_fit import with_residual
from odeform.models.training.run import Run

__all__ = ["train_latent"]


def train_latent(run: Run) -> Checkpoint:
    """Train on the data of `run`; an interrupted training is continued bit-exactly from `run.part`."""
    data = run.reduced_data()
    modes = data.space.basis.modes
    checkpoint = _trained_network(run, data)
    if "residual" not in run.request.without:
        checkpoint = with_residual(checkpoint, data)
    checkpoint, data = without_modes(checkpoint, data)
    run.report(f"{data.space.basis.modes} of {modes} modes are needed")
    checkpoint = with_qualities(checkpoint, Validation.of(data))
    return with_continuation(LatentModel(checkpoint), data)


def _trained_network(run: Run, data: TrainingData) -> Checkpoint:
    request = run.request
    net = build_network(data, request.seed)
    ablate(net, request.without)
    used = config.TrainConfig(request.minutes, request.steps, seed=request.seed, without=request.without)
    if "random-features" in request.without:
        used = replace(used, random_features=0)
    val = train_network(net, data, used, run.report, run.part, request.resume, run.loss, run.device)
    remove_ablated(net)
    settings = {"network": asdict(net.config), "qualities": {}, "training": asdict(used), "val": val}
    return run.reduced_checkpoint(data, {PREFIX + k: v for k, v in network_weights(net).items()}, settings)
