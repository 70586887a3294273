"""Training of one network for all shapes, on the motions of several bodies at once."""

from dataclasses import asdict, dataclass, replace

import numpy as np
import torch

from odeform.checkpoint import Checkpoint
from odeform.dataset.subsampling import FrameSubsampling
from odeform.dataset.training_data import FILLED_WEIGHT
from odeform.models.points.point_model import PREFIX, weights_in_steps
from odeform.models.points.point_network import Trial
from odeform.models.points.shape_inputs import Body, Ranges, descriptions, turns_to_force
from odeform.models.points.shape_network import ShapeNet, moved_rigidly, point_features
from odeform.models.points.training.fit import AHEAD, best_of_trials
from odeform.models.points.training.learner import PointLearner
from odeform.models.points.training.shape_data import BodyMotions, ShapeData, prepare_shapes
from odeform.models.training.body import body_arrays
from odeform.models.training.loss import Loss, torch_device
from odeform.models.training.run import Run
from odeform.types import Arrays

__all__ = ["ShapeLearner", "fit_shapes", "train_shapes"]

MOTIONS, CLOUD, POINTS = 48, 64, 8  # in a step: motions, points of their clouds, points whose motion is learned
STRIDES = (4, 2)  # frames per step of the ODE, from the start of training to its end
VALIDATED = 64  # points of a body on validation
TRIAL = Trial(2e-3, 128)


@dataclass(frozen=True, eq=False)
class _Split:
    """The motions of one body as tensors; see `BodyMotions` and `ShapePush` for axes and units."""

    x: torch.Tensor  # (N, 3)
    areas: torch.Tensor  # (N,)
    conditions: torch.Tensor  # (S, 9)
    contact: torch.Tensor  # (S, 3), turned
    turn: torch.Tensor  # (S, 3, 3)
    moved: torch.Tensor  # (S, T, N, 3)
    rotation: torch.Tensor  # (S, T, 3, 3)
    shift: torch.Tensor  # (S, T, 3)
    weights: torch.Tensor  # (S, T)
    metres: float  # of a radius of gyration
    spread: float  # RMS displacement, radii of gyration


@dataclass(frozen=True, eq=False)
class _Batch:
    """Q motions in turned axes: M points of their clouds, P points whose motion is known at F frames."""

    cloud: torch.Tensor  # (Q, M, 3)
    areas: torch.Tensor  # (Q, M)
    conditions: torch.Tensor  # (Q, 9)
    contact: torch.Tensor  # (Q, 3)
    x: torch.Tensor  # (Q, P, 3)
    moved: torch.Tensor  # (F, Q, P, 3)
    rigid: torch.Tensor  # (F, Q, P, 3)
    deformed: torch.Tensor  # (F, Q, P, 3)
    weights: torch.Tensor  # (F, Q)

    def mirrored(self, sign: torch.Tensor) -> "_Batch":
        """Motions whose sign (Q,) is -1 by their mirror images across the plane of the force."""
        flip = torch.stack([torch.ones_like(sign), sign, torch.ones_like(sign)], dim=1)  # (Q, 3)
        points = flip[:, None]
        conditions = torch.cat([self.conditions[:, :3] * flip, self.conditions[:, 3:]], dim=1)
        return replace(
            self,
            cloud=self.cloud * points,
            conditions=conditions,
            contact=self.contact * flip,
            x=self.x * points,
            moved=self.moved * points,
            rigid=self.rigid * points,
            deformed=self.deformed * points,
        )


class ShapeLearner(PointLearner):
    """One training of the network, on all bodies of the data."""

    def __init__(
        self, network: ShapeNet, data: ShapeData, trial: Trial, seed: int, device: torch.device, loss: Loss | None
    ) -> None:
        super().__init__(network.sizes(trial.width), trial.rate, seed, device)
        self.network, self.ranges, self.given_loss, self.device = network, data.ranges, loss, device
        self.train_split, self.val_split = (
            [_split(data.bodies[name], one, data.ranges, device) for name, one in data.motions[split].items()]
            for split in ("train", "val")
        )
        self.last = self.train_split[0].moved.shape[1] - 1

    def loss(self, fraction: float) -> torch.Tensor:
        frames = self._frames(fraction)
        drawn = torch.randint(0, len(self.train_split), (MOTIONS,), generator=self.generator).bincount()
        parts, scales = [], []
        for split, count in zip(self.train_split, drawn.tolist(), strict=False):
            if count:
                parts.append(self._drawn(split, count, frames))
                scales += count * [split]
        batch = _joined(parts)
        sign = 1.0 - 2.0 * torch.randint(0, 2, (MOTIONS,), generator=self.generator).float().to(self.device)
        batch = batch.mirrored(sign)
        rigid, whole, deformed = self.predicted(batch, frames)
        metres, spread = (
            torch.tensor([getattr(s, n) for s in scales], device=self.device) for n in ("metres", "spread")
        )
        if self.given_loss is not None:
            length = metres[:, None, None]
            return self.given_loss(
                length * whole, length * batch.moved, batch.weights[..., None].expand(whole.shape[:3])
            )
        # the mean over bodies of their RMSEs changes with a squared error by the inverse of the RMSE
        counted = batch.weights * metres / spread
        counted = counted / counted.mean()
        squares = (rigid - batch.rigid).square() / self.ranges.scale**2
        squares = squares + (deformed - batch.deformed).square() / self.ranges.part_scale**2
        return (counted[..., None, None] * squares).mean()

    def predicted(self, batch: _Batch, frames: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """(F, Q, P, 3) rigid displacements, displacements, and deformations, in radii of gyration."""
        net, network, units = self.net, self.network, self.ranges
        seen = point_features(net, batch.cloud, batch.contact)
        first = network.encode(net, seen, batch.areas, batch.conditions)
        states = network.states(net, first, frames.float().to(self.device) / self.last)
        rigid, deformed = network.decode(net, states, point_features(net, batch.x, batch.contact))
        shift, turn = units.scale * rigid[..., None, :3], units.scale * rigid[..., None, 3:]
        deformed = units.part_scale * deformed
        alone = moved_rigidly(net, batch.x, shift, turn) - batch.x
        return alone, moved_rigidly(net, batch.x + deformed, shift, turn) - batch.x, deformed

    def error(self) -> float:
        """The mean over bodies of their pooled RMSE on validation in mm, without frame 0."""
        frames, errors = torch.arange(self.last + 1), []
        for split in self.val_split:
            count, points = len(split.moved), len(split.x)
            generator = torch.Generator().manual_seed(0)
            chosen = torch.randint(0, points, (1, VALIDATED), generator=generator).expand(count, -1)
            batch = _gathered(split, torch.arange(count), None, chosen, frames)
            _, whole, _ = self.predicted(batch, frames)
            weights = batch.weights[1:, :, None, None] / batch.weights[1:].mean()
            square = float((weights * (whole - batch.moved)[1:].square()).mean())
            errors.append(1e3 * split.metres * square**0.5)
        return float(np.mean(errors))

    def _frames(self, fraction: float) -> torch.Tensor:
        stride = STRIDES[min(int(fraction * len(STRIDES)), len(STRIDES) - 1)]
        start = int(torch.randint(1, stride + 1, (1,), generator=self.generator))
        return torch.cat([torch.tensor([0]), torch.arange(start, self.last + 1, stride)])

    def _drawn(self, split: _Split, count: int, frames: torch.Tensor) -> _Batch:
        sequence = torch.randint(0, len(split.moved), (count,), generator=self.generator)
        # points of the cloud by area, so that each stands for as much of the surface
        cloud = torch.multinomial(split.areas.cpu(), count * CLOUD, True, generator=self.generator).reshape(count, -1)
        points = torch.randint(0, len(split.x), (count, POINTS), generator=self.generator)
        return _gathered(split, sequence, cloud, points, frames)


def _gathered(
    split: _Split, sequence: torch.Tensor, cloud: torch.Tensor | None, points: torch.Tensor, frames: torch.Tensor
) -> _Batch:
    """Motions `sequence` (Q,), with points `cloud` (Q, M) that count alike, or the whole cloud where that is None."""
    turn, x = split.turn[sequence], split.x[points]
    everything = split.x.expand(len(sequence), -1, -1)
    seen = everything if cloud is None else split.x[cloud]
    areas = split.areas.expand(len(sequence), -1) if cloud is None else torch.full(cloud.shape, 1.0 / cloud.shape[1])
    at = sequence[:, None], frames[None]  # (Q, F)
    moved = split.moved[sequence[:, None, None], frames[None, :, None], points[:, None]]  # (Q, F, P, 3)
    rotation, shift = split.rotation[at], split.shift[at][:, :, None]
    rigid = torch.einsum("qfij,qpj->qfpi", rotation, x) + shift - x[:, None]
    deformed = torch.einsum("qfji,qfpj->qfpi", rotation, x[:, None] + moved - shift) - x[:, None]

    def turned(frames: torch.Tensor) -> torch.Tensor:
        return torch.einsum("qij,qfpj->fqpi", turn, frames)

    def about(points: torch.Tensor) -> torch.Tensor:
        return torch.einsum("qij,qpj->qpi", turn, points)

    return _Batch(
        about(seen),
        areas.to(split.x.device),
        split.conditions[sequence],
        split.contact[sequence],
        about(x),
        turned(moved),
        turned(rigid),
        turned(deformed),
        split.weights[at].T,
    )


def _joined(parts: list[_Batch]) -> _Batch:
    """All motions of several batches."""
    dims = {"moved": 1, "rigid": 1, "deformed": 1, "weights": 1}
    names = _Batch.__dataclass_fields__
    return _Batch(**{name: torch.cat([getattr(part, name) for part in parts], dims.get(name, 0)) for name in names})


def _split(body: Body, motions: BodyMotions, ranges: Ranges, device: torch.device) -> _Split:
    def tensor(values: object) -> torch.Tensor:
        return torch.as_tensor(np.asarray(values), dtype=torch.float32, device=device)

    conditions = ranges.bounded(descriptions(body, motions.contact, motions.force))
    return _Split(
        x=tensor(body.frame(ranges).inputs(body.points - body.centre)),
        areas=tensor(body.areas),
        conditions=tensor(conditions),
        contact=tensor(ranges.denormalised(conditions)[:, :3]),
        turn=tensor(turns_to_force(motions.force)),
        moved=tensor(motions.moved),
        rotation=tensor(motions.rotation),
        shift=tensor(motions.shift),
        weights=tensor(np.where(motions.observed, 1.0, FILLED_WEIGHT)),
        metres=body.gyration_radius,
        spread=motions.spread,
    )


def train_shapes(run: Run) -> Checkpoint:
    """Train one network on all bodies of the data of `run`."""
    request = run.request
    return fit_shapes(
        prepare_shapes(run.dataset, FrameSubsampling(request.window, request.every, request.stagger)), run
    )


def fit_shapes(data: ShapeData, run: Run) -> Checkpoint:
    """Train one network on the bodies of `data`, which are those of the data set of `run`."""
    from odeform.models.points.shape_model import ShapeModel

    request, network, device = run.request, ShapeModel.network, torch_device(run.device)
    theta = np.concatenate(list(data.theta.values()))
    run.report(f"{request.model} on {len(theta)} sequences of {', '.join(data.bodies)}")
    training = {"model": request.model, "data": data.identity, "seed": request.seed}

    def learner(trial: Trial) -> PointLearner:
        return ShapeLearner(network, data, trial, request.seed, device, run.loss)

    weights, config = best_of_trials((TRIAL,), learner, training, run)
    schema = replace(run.dataset.schema, window=replace(data.window, reach=AHEAD), objects=tuple(data.bodies))
    bodies = {name: {"mass": body.mass, "young": body.young} for name, body in data.bodies.items()}
    config |= {"ranges": asdict(data.ranges), "bodies": bodies, "trained": list(bodies)}
    arrays: Arrays = weights_in_steps({PREFIX + name: value for name, value in weights.items()})
    for name in data.bodies:
        arrays |= {f"{name}/{key}": array for key, array in body_arrays(run.dataset.of(name)).items()}
    return Checkpoint(request.model, schema, config, run.with_body(arrays, theta))
