"""Stores a classical baseline of one body as a training does today: in steps, and without what is solved for."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from odeform.arrays import in_steps, row_steps
from odeform.checkpoint import Checkpoint
from odeform.dataset.training_data import ROUNDING
from odeform.errors import InputError
from odeform.models.baselines.trajectory_pod import TrajectoryPod, trajectory_weight
from odeform.models.kernels.regression import Kernel
from odeform.models.kernels.ridge import ORDERS
from odeform.models.reduced_model import ReducedModel
from odeform.models.registry import load_model
from odeform.motion.reduced_space import POSE
from odeform.types import Arrays, Floats

__all__ = ["is_stored_in_full", "stored_in_steps"]

BEFORE = ("basis.weights", "gp.weights")  # what is solved for today


def is_stored_in_full(checkpoint: Checkpoint) -> bool:
    """Whether it is a classical baseline of one body, as they were stored before."""
    return checkpoint.model in ("gp", "nearest", "pod-rbf") and "basis.weights" in checkpoint.arrays


def stored_in_steps(checkpoint: Checkpoint) -> Checkpoint:
    """Returns the same model with its arrays in steps. `InputError` for one that is not `is_stored_in_full`."""
    model = load_model(checkpoint)
    if not is_stored_in_full(checkpoint) or not isinstance(model, ReducedModel):
        raise InputError(f"{checkpoint.model}: expected a gp, nearest or pod-rbf of one body, stored in full")
    own, space = _nearest(checkpoint) if checkpoint.model == "nearest" else _pod(checkpoint, model), model.space
    modes = [space.with_modes(motion)[:, POSE:] for motion in _motions(own, len(checkpoint.arrays["times"]))]
    steps = row_steps(np.sqrt(np.square(modes).mean(axis=(0, 1))), ROUNDING)
    stepped = replace(space, basis=replace(space.basis, steps=steps)).arrays()
    kept = {name: array for name, array in checkpoint.arrays.items() if name not in BEFORE}
    return replace(checkpoint, arrays={**kept, **stepped, **own})


def _nearest(checkpoint: Checkpoint) -> Arrays:
    pose, local = (checkpoint.arrays[name].astype(float) for name in ("pose", "local"))
    even = np.full(len(pose), ROUNDING)
    return {**in_steps("pose", pose, even), **in_steps("local", local, even)}


def _pod(checkpoint: Checkpoint, model: ReducedModel) -> Arrays:
    """The mean, modes and coefficients; those of a kernel regression follow from its weights."""
    arrays, weight = checkpoint.arrays, trajectory_weight(model.space)
    every = np.tile(weight, len(arrays["times"]))
    if "gp.weights" in arrays:
        kernel = Kernel(np.array(checkpoint.config["length_scales"]), checkpoint.config.get("order", ORDERS[0]))
        weights, ridge = arrays["gp.weights"], float(checkpoint.config["ridge"])
        coefficients = kernel(arrays["theta"], arrays["theta"]) @ weights + ridge * weights
    else:
        coefficients = arrays["pod.coefficients"]
    return TrajectoryPod(weight, arrays["pod.mean"] * every, arrays["pod.modes"] * every, coefficients).arrays()


def _motions(own: Arrays, times: int) -> Float[np.ndarray, "sequences times y"]:
    """The training motions, of the arrays of a model."""
    if "pose" in own:
        return np.concatenate([own["pose"], own["local"]], axis=2, dtype=float)
    flat: Floats = own["pod.mean"] + own["pod.coefficients"] @ own["pod.modes"]
    return flat.reshape(len(flat), times, -1)
