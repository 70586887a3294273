"""The training of a vector field that is a module of PyTorch: Adam on roll-outs, best on validation, resumable."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from torch import nn

from odeform.checkpoint import Checkpoint
from odeform.dataset.training_data import FILLED_WEIGHT, TrainingData
from odeform.models.neural_model import NeuralModel, network_arrays
from odeform.models.training.descent import Budget, cosine_decay, descend, small_batches
from odeform.models.training.loss import Loss, mean_square, torch_device
from odeform.models.training.part import read_part, write_part
from odeform.models.training.qualities import Validation, with_qualities
from odeform.models.training.run import Run
from odeform.motion.reduced_space import POSE
from odeform.solver.integrate import SolverSettings
from odeform.types import Arrays, Floats

__all__ = ["train_neural"]

LONGEST = 0.01  # s of a step of a roll-out; longer frames are integrated in several
HORIZON = (0.25, 0.33)  # of a motion: what is rolled out at first; of the training: in which that grows
FEW = 8  # validation motions on which solver settings are chosen
SEEN = 64  # validation motions that choose the weights
CANDIDATES = [
    *(SolverSettings("dopri5", tolerance=tolerance) for tolerance in (1e-2, 3e-3, 1e-3, 1e-4, 1e-5)),
    SolverSettings("dopri5", tolerance=1e-7, dtype="float64"),
]
EXACT = SolverSettings("dopri5", tolerance=1e-9, dtype="float64")


def train_neural(model: type[NeuralModel], run: Run) -> Checkpoint:
    """Train on the data of `run`; an interrupted training is continued from `run.part`."""
    data = run.reduced_data(patterns=True)
    learner = _Learner(model, data, run)

    def made(weights: Arrays, val: dict[str, float]) -> Checkpoint:
        arrays = {**weights, "scale": learner.scale}
        return run.reduced_checkpoint(data, arrays, {"network": dict(model.settings), "qualities": {}, "val": val})

    # what the module cannot do in a prediction is found before it is trained
    untrained = model(made(network_arrays(learner.module), {}))
    body = untrained.evaluate_basis(untrained.rest, 0.0)
    for settings in (CANDIDATES[0], EXACT):
        untrained.integrate(data.theta["train"][0], body, settings, float(data.times[1]))
    val = learner.train()
    checkpoint, known = made(learner.best[1], val), Validation.of(data)
    few = Validation(known.theta[:FEW], known.times, known.reduced[:FEW], known.observed[:FEW])
    return with_qualities(checkpoint, few, EXACT, CANDIDATES)


class _Learner:
    def __init__(self, model: type[NeuralModel], data: TrainingData, run: Run) -> None:
        self.run, self.model, self.device = run, model, torch_device(run.device)
        self.loss: Loss = run.loss or mean_square
        train = data.reduced["train"]
        spread = np.sqrt((train**2).mean(axis=(0, 1)))
        # what does not move is not scaled up to one
        self.scale = np.maximum(spread, 1e-3 * spread.max())
        metres = self.scale.copy()
        metres[3:POSE] *= data.space.gyration_radius * np.sqrt(2.0 / 3.0)
        self.metres = self._tensor(metres)
        self.truth = {split: self._tensor(y / self.scale).transpose(0, 1) for split, y in data.reduced.items()}
        self.theta = {split: self._tensor(theta) for split, theta in data.theta.items()}
        filled = {"train": FILLED_WEIGHT, "val": 0.0}
        self.weights = {
            split: self._tensor(np.where(seen, 1.0, filled[split]).T) for split, seen in data.observed.items()
        }
        self.times = [float(time) for time in data.times]
        torch.manual_seed(run.request.seed)
        module = model.network(self.theta["train"].shape[1], train.shape[2], **model.settings)
        self.module: Any = module.to(self.device)
        self.optimiser = torch.optim.Adam(module.parameters(), lr=model.rate)
        self.generator = torch.Generator().manual_seed(run.request.seed)
        self.best: tuple[float, dict[str, Any]] = (math.inf, {})
        self.done, self.elapsed = 0, 0.0
        self.training = {"data": data.identity, "model": model.model, "seed": run.request.seed}
        self.training |= {"settings": dict(model.settings), "rate": model.rate, "batch": model.batch}

    def _tensor(self, values: Floats) -> torch.Tensor:
        return torch.as_tensor(np.asarray(values, dtype=np.float32), device=self.device)

    def predicted(self, theta: torch.Tensor, frames: int) -> torch.Tensor:
        """(frames + 1, B, C) whitened coordinates at the frames, by RK4."""
        state = self.module.initial_state(theta)
        states = [state]
        for begin, end in zip(self.times[:frames], self.times[1 : frames + 1], strict=True):
            count = math.ceil((end - begin) / LONGEST - 1e-9)
            step = (end - begin) / count
            for index in range(count):
                state = _rk4(self.module.vector_field, begin + index * step, state, theta, step)
            states.append(state)
        rolled = torch.stack(states)
        at = torch.tensor(self.times[: frames + 1], device=self.device)
        each = (at[:, None].expand(rolled.shape[:2]), rolled, theta.expand(len(rolled), *theta.shape))
        out = self.module.readout(*(part.flatten(0, 1) for part in each)).reshape(*rolled.shape[:2], -1)
        return out - out[:1]

    def error(self, split: str, rows: torch.Tensor, frames: int, loss: Loss) -> torch.Tensor:
        predicted = self.predicted(self.theta[split][rows], frames)
        truth, weights = self.truth[split][: frames + 1, rows], self.weights[split][: frames + 1, rows]
        return loss(self.metres * predicted[1:], self.metres * truth[1:], weights[1:])

    def advance(self, fraction: float) -> float:
        frames, (start, grown) = len(self.times) - 1, HORIZON
        frames = max(min(frames, round(frames * (start + (1.0 - start) * fraction / grown))), 2)
        self.optimiser.param_groups[0]["lr"] = self.model.rate * cosine_decay(fraction)
        rows = torch.randperm(len(self.theta["train"]), generator=self.generator)[: self.model.batch]
        self.optimiser.zero_grad()
        loss = self.error("train", rows.to(self.device), frames, self.loss)
        loss.backward()
        if torch.isfinite(nn.utils.clip_grad_norm_(self.module.parameters(), 1.0)):
            self.optimiser.step()
        self.done += 1
        return float(loss.detach())

    @torch.no_grad()
    def validate(self) -> float:
        """RMSE in mm over coordinates; keeps the weights if they are the best so far."""
        rows = torch.arange(min(SEEN, len(self.theta["val"])), device=self.device)
        error = 1e3 * math.sqrt(float(self.error("val", rows, len(self.times) - 1, mean_square)) / 3.0)
        if error < self.best[0] or not self.best[1]:
            self.best = error, {name: value.copy() for name, value in network_arrays(self.module).items()}
        return error

    def train(self) -> dict[str, float]:
        """Take steps until the budget is spent; returns the validation error in mm, steps and seconds."""
        request, part = self.run.request, self.run.part
        if request.resume and part is not None:
            self.restore()
            self.run.report(f"continues after {self.elapsed / 60.0:.1f} min, step {self.done}")
        budget = Budget(60.0 * request.minutes, request.steps)
        with small_batches():
            descend(self, budget, self.run.report, self.save if part is not None else lambda: None)
        return {"val_rmse_mm": self.best[0], "steps": self.done, "seconds": self.elapsed}

    def save(self) -> None:
        best = {name: torch.from_numpy(value) for name, value in self.best[1].items()}
        state = {"module": self.module.state_dict(), "optimiser": self.optimiser.state_dict(), "best": best}
        state |= {"generator": self.generator.get_state(), "error": self.best[0]}
        assert self.run.part is not None
        write_part(self.run.part, self.training, {**state, "done": self.done, "elapsed": self.elapsed})

    def restore(self) -> None:
        assert self.run.part is not None
        state = read_part(self.run.part, self.training)
        self.module.load_state_dict(state["module"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.generator.set_state(state["generator"])
        self.best = state["error"], {name: value.numpy() for name, value in state["best"].items()}
        self.done, self.elapsed = state["done"], state["elapsed"]


def _rk4(field: Callable[..., Any], time: float, state: Any, theta: Any, step: float) -> Any:
    one = field(time, state, theta)
    two = field(time + 0.5 * step, state + 0.5 * step * one, theta)
    three = field(time + 0.5 * step, state + 0.5 * step * two, theta)
    return state + step / 6.0 * (one + 2.0 * two + 2.0 * three + field(time + step, state + step * three, theta))
