"""The regression of what a trained ODE leaves unexplained, kept where it explains validation motions."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.stats import t as student

from odeform.checkpoint import Checkpoint
from odeform.dataset.training_data import TrainingData
from odeform.models.kernels.ridge import ORDERS, search_ridge
from odeform.models.reduced_model import ReducedModel
from odeform.models.registry import load_model
from odeform.models.residual import PARTS, ParameterRegression, RegressedPart
from odeform.models.training.pruning import FINE
from odeform.types import Floats

__all__ = ["with_residual"]

LEFT_OUT = 1e-3
CHANCE = 0.05  # most that the probability may be that a weight of the ODE pays on validation by chance
EXPLAINED = 0.05  # fraction of a part's mean square residual on validation, from which on it has a residual


def with_residual(checkpoint: Checkpoint, data: TrainingData, fading: tuple[int, int] | None = None) -> Checkpoint:
    """Return the checkpoint of a trained ODE with a residual of those parts of y that it improves on validation.

    Unchanged where no part is improved, and where a spline filled in frames. With `fading`, the residual fades from
    the first of these frames to the last, and its kernel is chosen for those before: chance landings later on would
    hide how smooth a push is in the parameters.
    """
    if not all(data.observed[split].all() for split in data.observed):
        return checkpoint
    model, parts = load_model(checkpoint), {}
    assert isinstance(model, ReducedModel)
    times = data.times if fading is None else data.times[: fading[1] + 1]
    evaluated, stop = model.evaluate_basis(model.rest, 0.0), float(times[-1])
    motions = {
        split: np.stack([model.trajectory(one, evaluated, FINE, stop).reduced(times) for one in data.theta[split]])
        for split in data.theta
    }
    for name, columns in PARTS.items():
        truth, motion = (
            {split: _flat(of[split][:, : len(times)], columns) for split in of} for of in (data.reduced, motions)
        )
        if not truth["train"].any() and not motion["train"].any():
            continue
        entries = searched = truth["train"].shape[1]
        given = None
        if fading is not None:
            searched, given = entries * (fading[0] + 1) // len(times), 1.0
            left = np.repeat(_left(fading), entries // len(times))
            truth = {split: motion[split] + left * (of - motion[split]) for split, of in truth.items()}
        part, explained = _fitted(data.theta, truth, motion, searched, given)
        if explained >= EXPLAINED:
            parts[name] = part
    if not parts:
        return checkpoint
    regression = ParameterRegression((len(times), data.space.coordinates), parts)
    weights = {name: round(part.weight, 3) for name, part in parts.items()}
    config = {**checkpoint.config, "correction": {"share_of_ode": weights}}
    return replace(checkpoint, config=config, arrays={**checkpoint.arrays, **regression.arrays(times)})


def _left(fading: tuple[int, int]) -> Floats:
    """Fades a residual out: the weight that is left of it in the frames up to the last of `fading`."""
    begin, end = fading
    faded = np.clip((np.arange(end + 1) - begin) / (end - begin), 0.0, 1.0)
    return 1.0 - faded**2 * (3.0 - 2.0 * faded)


def _flat(reduced: Floats, columns: slice) -> Floats:
    return reduced[..., columns].reshape(len(reduced), -1)


def _fitted(
    theta: Mapping[str, Floats],
    truth: Mapping[str, Floats],
    motion: Mapping[str, Floats],
    searched: int,
    given: float | None,
) -> tuple[RegressedPart, float]:
    """A part's kernel and the weight of the ODE, from flat trajectories (S, entries) by split; and what it explains on
    validation.

    Length scales, ridge and order are those of the first `searched` entries of the motions themselves: residuals on
    training do not tell how smooth those of other parameters are. Unless `given`, the weight has the smallest error on
    validation, relative in each sequence: in small sets one hard sequence would decide. It is zero where that
    improvement may be chance, as with few validation motions it often is.
    """
    known, asked = theta["train"], theta["val"]
    mean, motion_mean = truth["train"].mean(axis=0), motion["train"].mean(axis=0)
    # inner products are all that the search needs: coordinates in place of entries
    both = (np.concatenate([truth["train"], truth["val"]]) - mean)[:, :searched]
    u, sizes, _ = np.linalg.svd(both, full_matrices=False)
    outputs, expected = np.split(u * sizes, [len(known)])
    # without validation, where what it predicts is compared with the ODE
    ridge = search_ridge(known, outputs, orders=ORDERS)[0]

    alone = mean + ridge.fit(known, truth["train"] - mean)(asked) - truth["val"]
    added = motion["val"] - motion_mean - ridge.fit(known, motion["train"] - motion_mean)(asked)
    left = motion["val"] - truth["val"]
    weights = 1.0 / np.maximum(_norms(alone) * _norms(left), 1e-30)
    ode_weight = given
    if ode_weight is None:
        ode_weight = -(weights @ (alone * added).sum(axis=1)) / max(weights @ np.square(added).sum(axis=1), 1e-30)
        ode_weight = float(np.clip(ode_weight, 0.0, 1.0))
        gained = np.log(np.maximum(_norms(alone), 1e-30) / np.maximum(_norms(alone + ode_weight * added), 1e-30))
        if _chance(gained) > CHANCE:
            ode_weight = 0.0
    residual = alone + ode_weight * added
    explained = 1.0 - (weights @ np.square(residual).sum(axis=1)) / max(weights @ np.square(left).sum(axis=1), 1e-30)

    ridge = search_ridge(known, outputs, (asked, expected), ridge)[0]
    rest = truth["train"] - ode_weight * motion["train"]
    u, sizes, modes = np.linalg.svd(rest - rest.mean(axis=0), full_matrices=False)
    dropped = np.cumsum(sizes[::-1] ** 2)[::-1] / len(known)  # by the modes from each one on
    count = int((dropped > LEFT_OUT * np.square(residual).sum(axis=1).mean()).sum())
    regression = ridge.fit(known, (u * sizes)[:, :count])
    return RegressedPart(regression, modes[:count], rest.mean(axis=0), ode_weight), float(explained)


def _chance(gained: Floats) -> float:
    """The probability of such a mean, or a larger one, where the true mean is zero (one-sided t-test)."""
    if len(gained) < 2:
        return 1.0
    spread = gained.std(ddof=1) / np.sqrt(len(gained))
    return float(student.sf(gained.mean() / max(spread, 1e-30), len(gained) - 1))


def _norms(rows: Floats) -> Floats:
    return np.linalg.norm(rows, axis=1)
