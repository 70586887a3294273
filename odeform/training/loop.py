"""Training of the ODeform network by whole roll-outs and variable projection.

The readout of the decoders is linear, so its best value for any states is known: a least-squares solve. Each step
solves for it on its batch and descends in everything else (variable projection, Golub & Pereyra 1973): descent shapes
the states, and the last millimetres, which it would take hours for, come from the solve. Once that is done, random
features of what the decoders see widen them, and one solve in double precision uses them all.
"""

import json
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import nn

from odeform.errors import InputError
from odeform.files import safetensors_metadata, write_aside
from odeform.model.config import ModelConfig
from odeform.model.data import TrainingData
from odeform.model.network import ODeformNet
from odeform.model.reduced import POSE
from odeform.training.losses import Metric, balanced
from odeform.training.readout import NormalEquations, random_layer
from odeform.training.tree import fill, strip
from odeform.types import Arrays

__all__ = ["TrainConfig", "build_network", "network_weights", "train_network"]

CLOCK_GAINS = (3.0, 30.0)  # how sharply features of the clock bend at first: contacts are short, and descent is slow
CHUNK = 64  # sequences rolled out at once where no gradients are wanted
FREE = ("minutes", "steps", "report", "random_features", "sharpnesses", "components", "last_ridges", "refine")
"""Settings that may change when a training is resumed: of its length, and of what is solved for at its end."""


@dataclass(frozen=True)
class TrainConfig:
    """How to train."""

    minutes: float = 30.0
    """Wall time, unless `steps` are given."""
    steps: int | None = None
    """So many steps, however long they take: the same result on a busy machine."""
    seed: int = 0
    batch: int = 64
    """Sequences in a step."""
    rate: float = 5e-3
    """Learning rate at the start; falls by a cosine to nothing."""
    horizon: tuple[float, float] = (0.25, 0.33)
    """Share of the motion that is rolled out at first, and share of the time in which it grows to the whole."""
    ridge: float = 1e-6
    """Of the readout's least squares, relative to the mean square of a feature."""
    random_features: int = 1500
    """Of each decoder, added at the end."""
    sharpnesses: tuple[float, ...] = (0.5, 1.0, 2.0)
    """Of random features: among these and `last_ridges`, validation chooses for each decoder, fitted to every other
    frame, so that what is between frames counts."""
    last_ridges: tuple[float, ...] = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
    """Of the last solve."""
    longest: float = 0.01
    """Seconds; longer frames are integrated in several steps while descending."""
    refine: int = 3
    """As many times more steps where no gradients are wanted, which then leave no error of their own."""
    report: float = 60.0
    """Seconds between lines of progress, and between saved states."""


def build_network(data: TrainingData, seed: int) -> ODeformNet:
    """A fresh network, whitened by the training data alone."""
    torch.manual_seed(seed)
    train = data.reduced["train"]
    rigid = "rigid" in data.schema.parts
    config = ModelConfig(parameters=data.theta["train"].shape[1], modes=train.shape[-1] - POSE, rigid=rigid)
    net = ODeformNet(config)
    spread = np.sqrt((train**2).mean(axis=(0, 1)))
    gains = np.concatenate(
        [np.full(3, np.linalg.norm(spread[:3])), np.full(3, np.linalg.norm(spread[3:6])), spread[6:]]
    )
    # what does not move, as the turn of a ball that falls straight, is not blown up to size one
    floor = 1e-3 * gains[:3].max() / np.repeat([1.0, data.space.arm, 1.0], [3, 3, len(gains) - POSE])
    floor[POSE:] = 1e-9
    net.gains.copy_(torch.as_tensor(np.maximum(gains, floor)))
    # fields of order one should cross the latent space in a few frames, not in a second
    net.time_scale.fill_(0.05)
    for decoder in net.decoders:
        for layer in decoder.hidden:
            if isinstance(layer, nn.Linear):
                # features have to differ before a readout can make use of them
                layer.weight.data *= 2.0
                nn.init.uniform_(layer.bias, -1.0, 1.0)
        first = decoder.hidden[0]
        assert isinstance(first, nn.Linear)
        (low, high), count = CLOCK_GAINS, first.out_features
        sharp = low * (high / low) ** torch.rand(count) * torch.randn(count)
        first.weight.data[:, -1 - config.parameters] = sharp
        first.bias.data -= sharp * (2.0 * torch.rand(count) - 1.0)
    shape = _shape(data)
    for encoder in net.encoders:
        encoder.standardise([shape])
    return net


def _shape(data: TrainingData) -> tuple[torch.Tensor, torch.Tensor]:
    return torch.as_tensor(data.rest / data.space.arm).float(), torch.as_tensor(data.weights).float()


def _soap(weights: list[nn.Parameter], rate: float) -> torch.optim.Optimizer:
    """Adam in the eigenbasis of Shampoo's preconditioner (Vyas et al. 2024): roll-outs bend the loss differently in
    every direction, and it takes hundreds of steps to where Adam takes thousands."""
    try:
        from pytorch_optimizer import SOAP
    except ImportError as error:
        raise InputError(f"training needs {error.name}: pip install 'odeform[train]'") from None
    return SOAP(weights, lr=rate, weight_decay=1e-4)


class _Trainer:
    def __init__(self, net: ODeformNet, data: TrainingData, config: TrainConfig, device: torch.device) -> None:
        self.net, self.config, self.device = net.to(device), config, device
        self.metric = Metric(net.gains, data.space.arm)
        gains = net.gains.cpu().double().numpy()
        # frames first, as roll-outs have them
        self.truth = {
            k: torch.as_tensor(v / gains).float().transpose(0, 1).contiguous().to(device)
            for k, v in data.reduced.items()
        }
        self.theta = {k: torch.as_tensor(v).float().to(device) for k, v in data.theta.items()}
        self.times = torch.as_tensor(data.times).float().to(device)
        frame = float(data.times[1] - data.times[0])
        self.frame, self.substeps = frame, max(1, math.ceil(frame / config.longest - 1e-9))
        self.identity = data.identity
        points, shares = _shape(data)
        self.shape = points.to(device), shares.to(device)
        self.frames = len(self.truth["train"]) - 1
        self.generator = torch.Generator().manual_seed(config.seed)
        for decoder in net.decoders:
            decoder.readout.requires_grad_(False)  # solved for
        self.weights = [w for w in net.parameters() if w.requires_grad]
        self.optimiser = _soap(self.weights, config.rate)
        self.outputs = [slice(0, POSE), slice(POSE, None)] if net.config.rigid else [slice(POSE, None)]
        self.done = 0
        self.elapsed = 0.0

    def states(self, theta: torch.Tensor, counts: list[int]) -> torch.Tensor:
        """At the start and after each frame, which is integrated in `counts` steps."""
        start = self.net.encode(self.shape, theta)
        steps = [self.frame / count for count in counts for _ in range(count)]
        return self.net.roll_out(start, theta, steps)[np.cumsum([0, *counts])]

    def draw_counts(self, frames: int) -> list[int]:
        """Some frames in one step more than others: a field that leans on the error of its steps gains nothing by it.

        Descent finds such fields otherwise, which fit the data at one step and miss it by ten times as much at another.
        """
        more = torch.randint(0, 2, (frames,), generator=self.generator)
        return (self.substeps + more).tolist()

    def loss(self, rows: torch.Tensor, frames: int) -> torch.Tensor:
        """Of a batch, after its readout has been solved for."""
        theta, truth = self.theta["train"][rows], self.truth["train"][: frames + 1, rows]
        states = self.states(theta, self.draw_counts(frames))
        told = self.net.told(self.times[: frames + 1], theta)
        predicted = [states.new_zeros(*states.shape[:-1], POSE)] if not self.net.config.rigid else []
        for decoder, place, out in zip(self.net.decoders, self.net.places, self.outputs, strict=True):
            features = decoder.features(states[..., place], told)
            readout = NormalEquations()
            # every other frame tells as much, and a solve costs as much as the roll-out
            readout.add(features.detach()[::2], truth[::2][..., out])
            decoder.readout.weight.data = readout.solve(self.config.ridge).to(features.dtype)
            predicted.append(decoder.readout(features))
        return balanced(*self.metric(torch.cat(predicted, dim=-1)[1:], truth[1:])[-len(self.outputs) :])

    def advance(self, share: float) -> None:
        """One step of descent."""
        config = self.config
        start, grown = config.horizon
        frames = min(self.frames, round(self.frames * (start + (1.0 - start) * share / grown)))
        warm = min(1.0, (self.done + 1) / 20.0)
        self.optimiser.param_groups[0]["lr"] = warm * config.rate * 0.5 * (1.0 + np.cos(np.pi * share))
        rows = torch.randperm(len(self.theta["train"]), generator=self.generator)[: config.batch]
        self.optimiser.zero_grad()
        self.loss(rows.to(self.device), max(frames, 2)).backward()
        norm = nn.utils.clip_grad_norm_(self.weights, 1.0)
        if torch.isfinite(norm):
            self.optimiser.step()
        self.done += 1

    def _chunks(self, split: str) -> Iterator[tuple[torch.Tensor, torch.Tensor, torch.Tensor]]:
        """Rows of a split, their parameters, their whole roll-outs."""
        counts = [self.config.refine * self.substeps] * self.frames
        for rows in torch.arange(len(self.theta[split])).split(CHUNK):
            theta = self.theta[split][rows]
            yield rows, theta, self.states(theta, counts)

    @torch.no_grad()
    def equations(self, every: int = 1) -> list[NormalEquations]:
        """Of the readout of each decoder, from every k-th frame of all training sequences."""
        all_of = [NormalEquations() for _ in self.net.decoders]
        for rows, theta, states in self._chunks("train"):
            told = self.net.told(self.times, theta)
            for equations, decoder, place, out in zip(
                all_of, self.net.decoders, self.net.places, self.outputs, strict=True
            ):
                features = decoder.features(states[..., place], told)
                equations.add(features[::every], self.truth["train"][::every, rows][..., out])
        return all_of

    def solve_readout(self, ridge: float) -> None:
        """The readout of all training sequences."""
        for equations, decoder in zip(self.equations(), self.net.decoders, strict=True):
            decoder.readout.weight.data = equations.solve(ridge).to(decoder.readout.weight.dtype)

    @torch.no_grad()
    def widen(self) -> None:
        """Random features for each decoder; the readout of all, in double precision, in which the network then is.

        The large weights of a solve over many features cancel: single precision would leave its rounding.
        """
        net = self.net.double()
        self.metric.double()
        self.truth, self.theta = ({k: v.double() for k, v in x.items()} for x in (self.truth, self.theta))
        self.shape = self.shape[0].double(), self.shape[1].double()
        self.times = self.times.double()
        net.widen(self.config.random_features)
        best = [float("inf") for _ in net.decoders]
        kept, ridges = [decoder.state_dict() for decoder in net.decoders], [0.0 for _ in net.decoders]
        for sharpness in self.config.sharpnesses:
            self._draw_features(sharpness)
            all_of = self.equations(every=2)
            for ridge in self.config.last_ridges:
                for equations, decoder in zip(all_of, net.decoders, strict=True):
                    decoder.readout.weight.data = equations.solve(ridge)
                errors = self.errors_mm("val")[-len(best) :]
                for index, (decoder, error) in enumerate(zip(net.decoders, errors, strict=True)):
                    if error < best[index]:
                        best[index], ridges[index], kept[index] = error, ridge, deepcopy(decoder.state_dict())
        for decoder, state in zip(net.decoders, kept, strict=True):
            decoder.load_state_dict(state)
        for equations, decoder, ridge in zip(self.equations(), net.decoders, ridges, strict=True):
            decoder.readout.weight.data = equations.solve(ridge)

    def _draw_features(self, sharpness: float) -> None:
        net = self.net
        for decoder, place in zip(net.decoders, net.places, strict=True):
            assert decoder.random is not None
            seen = []
            for _, theta, states in self._chunks("train"):
                told = net.told(self.times, theta)
                seen.append(torch.cat([decoder.trained(states[..., place], told), told], dim=-1).flatten(0, 1))
            layer = random_layer(
                seen,
                net.config.parameters,
                net.config.components,
                net.config.random_features,
                sharpness,
                torch.Generator(self.device).manual_seed(self.config.seed),
            )
            decoder.random.load_state_dict(layer)

    @torch.no_grad()
    def errors_mm(self, split: str) -> tuple[float, float]:
        """Pooled RMSE over coordinates, in mm: of the rigid part and of the deformation."""
        total = torch.zeros(2, device=self.device)
        for rows, theta, states in self._chunks(split):
            predicted = self.net.decode(states, self.times, theta)
            total += len(rows) * torch.stack(self.metric(predicted[1:], self.truth[split][1:, rows]))
        rigid, local = (total / len(self.theta[split]) / 3.0).sqrt().tolist()
        return rigid, local

    def _fingerprint(self) -> dict[str, Any]:
        """What has to be the same for a training to go on."""
        config = {k: v for k, v in asdict(self.config).items() if k not in FREE}
        network = {k: v for k, v in asdict(self.net.config).items() if k not in FREE}
        return {"data": self.identity, "network": network, "config": config}

    def save(self, path: Path) -> None:
        tensors = {f"net.{name}": value for name, value in self.net.state_dict().items()}
        optimiser = strip(self.optimiser.state_dict(), tensors, "optimiser")
        tensors["generator"] = self.generator.get_state()
        meta = {**self._fingerprint(), "done": self.done, "elapsed": self.elapsed, "optimiser": optimiser}
        tensors = {name: value.contiguous() for name, value in tensors.items()}
        write_aside(path, save(tensors, {"training": json.dumps(meta)}))

    def restore(self, path: Path) -> None:
        try:
            data = path.read_bytes()
        except OSError as error:
            raise InputError(f"--resume: {path}: {error.strerror}; expected what an interrupted run left") from None
        try:
            tensors = load(data)
            meta: dict[str, Any] = json.loads(safetensors_metadata(data)["training"])
            for part, wanted in json.loads(json.dumps(self._fingerprint())).items():
                if meta[part] != wanted:
                    raise InputError(f"--resume: {path}: another training, of {part} {meta[part]}; expected {wanted}")
            weights = {k.removeprefix("net."): v for k, v in tensors.items() if k.startswith("net.")}
            self.net.load_state_dict(weights)
            optimiser = fill(meta["optimiser"], tensors)
            optimiser["state"] = {int(index): state for index, state in optimiser["state"].items()}
            self.optimiser.load_state_dict(optimiser)
            self.generator.set_state(tensors["generator"])
            self.done, self.elapsed = int(meta["done"]), float(meta["elapsed"])
        except InputError:
            raise
        except (SafetensorError, KeyError, ValueError, TypeError, RuntimeError) as error:
            raise InputError(f"--resume: {path}: not the state of this training: {error}") from None


@contextmanager
def _small_batches() -> Iterator[None]:
    """One thread of the processor: batches are small, and results do not depend on the number of cores.

    Denormal numbers slow such a run thirty-fold on some processors; elsewhere they count (SciPy's k-d tree recurses
    without end where they are taken for 0).
    """
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
        torch.set_flush_denormal(False)


def _descend(trainer: _Trainer, config: TrainConfig, report: Callable[[str], None], part: Path | None) -> None:
    """Take steps until the budget of `config` is spent."""
    seconds = 60.0 * config.minutes
    begin, printed = time.monotonic() - trainer.elapsed, trainer.elapsed

    def spent() -> float:
        """The share of the budget."""
        done, budget = (trainer.elapsed, seconds) if config.steps is None else (trainer.done, config.steps)
        return done / budget if budget else 1.0

    try:
        while (share := spent()) < 1.0:
            trainer.advance(share)
            trainer.elapsed = time.monotonic() - begin
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
) -> dict[str, float]:
    """Train in place, on a GPU where there is one; returns validation errors in mm and the number of steps.

    The state goes to the file `part` at every report and when interrupted; `resume` continues from there.
    """
    with _small_batches():
        trainer = _Trainer(net, data, config, torch.device("cuda" if torch.cuda.is_available() else "cpu"))
        if resume and part is not None:
            trainer.restore(part)
            report(f"continues after {trainer.elapsed / 60.0:.1f} min, step {trainer.done}")
        elif part is not None and part.exists():
            report(f"starts anew; {part} of an interrupted training will be overwritten (--resume would continue it)")
        _descend(trainer, config, report, part)
    if part is not None:
        trainer.save(part)
    if config.random_features:
        trainer.widen()
    else:
        trainer.solve_readout(config.ridge)
    rigid, local = trainer.errors_mm("val")
    net.cpu()
    return {
        "val_rigid_rmse_mm": rigid,
        "val_deformation_rmse_mm": local,
        "steps": trainer.done,
        "seconds": trainer.elapsed,
    }


def network_weights(net: ODeformNet) -> Arrays:
    """All in single precision but readouts, whose large weights cancel."""
    state = {name: value.detach().cpu() for name, value in net.state_dict().items()}
    return {k: (v if k.endswith("readout.weight") else v.float()).numpy() for k, v in state.items()}
