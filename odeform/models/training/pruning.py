"""Drops the modes that a trained model does not need: each costs time and memory at every point of every frame.

How many modes the data need is known before training; how many of them a network predicts well, only after.
"""

from dataclasses import replace

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.dataset.training_data import TrainingData
from odeform.models.latent.model import PREFIX, LatentModel
from odeform.models.residual import ParameterRegression
from odeform.motion.reduced_space import POSE
from odeform.solver.integrate import SolverSettings

__all__ = ["FINE", "LARGE", "needed_modes", "without_modes"]

FINE = SolverSettings("dopri5", tolerance=1e-6, dtype="float64")
WORSE = 1.01
"""Factor by which dropping modes may increase the error of large deformations."""
LARGE = 0.1
"""Fraction of the peak from which a deformation is large, as in `deformation_relative`: errors long after a contact
would hide others."""


def needed_modes(model: LatentModel, data: TrainingData) -> int:
    """The fewest modes whose error of large validation deformations is at most `WORSE` times that of all modes."""
    evaluated, times = model.evaluate_basis(model.rest, 0.0), data.times
    motions = [model.trajectory(theta, evaluated, FINE, float(times[-1])).reduced(times) for theta in data.theta["val"]]
    truth = data.reduced["val"][..., POSE:]
    size = np.linalg.norm(truth, axis=2)
    weights = data.observed["val"] * (size > LARGE * size.max(axis=1, keepdims=True))
    residual = np.stack(motions)[..., POSE:] - truth
    wrong, still = (np.einsum("st,stk->k", weights, x**2) for x in (residual, truth))
    # the error of a dropped mode is the whole mode
    errors = [wrong[:count].sum() + still[count:].sum() for count in range(1, len(wrong) + 1)]
    return 1 + int(np.argmax(np.array(errors) <= WORSE**2 * errors[-1]))


def without_modes(checkpoint: Checkpoint, data: TrainingData) -> tuple[Checkpoint, TrainingData]:
    """The checkpoint of a trained ODeform and its data, with only the modes that it needs."""
    model = LatentModel(checkpoint)
    count = needed_modes(model, data)
    space = replace(data.space, basis=data.space.basis.first(count))
    reduced = {split: y[..., : POSE + count] for split, y in data.reduced.items()}
    readout, gains = f"{PREFIX}local_decoder.readout.weight", f"{PREFIX}gains"
    kept = {readout: checkpoint.arrays[readout][:count], gains: checkpoint.arrays[gains][: POSE + count]}
    if model.residual is not None:
        assert isinstance(model.residual.regression, ParameterRegression)
        kept |= model.residual.regression.first(count).arrays(model.residual.times)
    config = {**checkpoint.config, "network": {**checkpoint.config["network"], "modes": count}}
    arrays = {**checkpoint.arrays, **kept, **space.arrays()}
    return replace(checkpoint, config=config, arrays=arrays), replace(data, space=space, reduced=reduced)
