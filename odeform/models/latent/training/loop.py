"""Training of the ODeform network by whole roll-outs and variable projection.

The readout of the decoders is linear, so its best value for given states is a least-squares solve. Each step solves for
it on its batch and descends in everything else (variable projection, Golub & Pereyra 1973): descent shapes the states,
and the solve removes the last millimetres, which would take descent hours. Afterwards random features of the decoders'
inputs are added, and one solve in double precision uses them all.
"""

import time
from collections.abc import Callable
from pathlib import Path

from odeform.dataset.training_data import TrainingData
from odeform.models.latent.network import ODeformNet
from odeform.models.latent.training.config import TrainConfig
from odeform.models.latent.training.random_features import affordable, widen
from odeform.models.latent.training.trainer import Trainer
from odeform.models.training.descent import small_batches
from odeform.models.training.loss import Loss, torch_device
from odeform.types import Arrays

__all__ = ["network_weights", "train_network"]


def _descend(trainer: Trainer, config: TrainConfig, report: Callable[[str], None], part: Path | None) -> None:
    """Take steps until the budget of `config` is spent; save the state to `part` now and then."""
    seconds = 60.0 * config.minutes * (1.0 - config.widening * bool(config.random_features))
    begin, printed = time.process_time() - trainer.elapsed, trainer.elapsed

    def spent() -> float:
        """The fraction of the budget that is spent."""
        done, budget = (trainer.elapsed, seconds) if config.steps is None else (trainer.done, config.steps)
        return done / budget if budget else 1.0

    try:
        while (fraction := spent()) < 1.0:
            trainer.advance(fraction)
            trainer.elapsed = time.process_time() - begin
            if trainer.elapsed - printed > config.report:
                printed = trainer.elapsed
                trainer.solve_readout(config.ridge)
                rigid, local = trainer.errors_mm("val")
                done = f"{100 * spent():.0f} %, step {trainer.done}"
                report(f"{done}: rigid {rigid:.3f} mm, deformation {local:.4f} mm (val)")
                if part is not None:
                    trainer.save(part)
    except KeyboardInterrupt:
        if part is not None:
            trainer.save(part)
            report(f"interrupted; --resume continues from {part}")
        raise


def train_network(
    net: ODeformNet,
    data: TrainingData,
    config: TrainConfig,
    report: Callable[[str], None] = print,
    part: Path | None = None,
    resume: bool = False,
    loss: Loss | None = None,
    device: str | None = None,
) -> dict[str, float]:
    """Train in place; return validation errors in mm, steps, batch size and seconds.

    A `loss` shapes the states; readouts are solved for by least squares all the same. The `device` is a GPU if there is
    one, unless it is named. The state is written to `part` at every report and on interruption; `resume` continues from
    there.
    """
    begin = time.process_time()
    with small_batches():
        trainer = Trainer(net, data, config, torch_device(device), loss)
        if resume and part is not None:
            trainer.restore(part)
            begin -= trainer.elapsed
            report(f"continues after {trainer.elapsed / 60.0:.1f} min, step {trainer.done}")
        _descend(trainer, config, report, part)
        if part is not None:
            trainer.save(part)
        if config.random_features:
            count = config.random_features
            if config.steps is None:
                count = affordable(trainer, 60.0 * config.minutes * config.widening)
            widen(trainer, count)
        else:
            trainer.solve_readout(config.ridge)
        rigid, local = trainer.errors_mm("val")
    net.cpu()
    return {
        "val_rigid_rmse_mm": rigid,
        "val_deformation_rmse_mm": local,
        "steps": trainer.done,
        "batch": trainer.batch,
        "seconds": time.process_time() - begin,
    }


def network_weights(net: ODeformNet) -> Arrays:
    """Returns the arrays of a checkpoint: single precision, except for readouts, whose large weights cancel."""
    state = {name: value.detach().cpu() for name, value in net.state_dict().items()}
    return {k: (v if k.endswith("readout.weight") else v.float()).numpy() for k, v in state.items()}
