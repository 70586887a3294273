"""Kernel regression of the motions of a body that is pushed at a point, in the contact's frame.

Shift, rotation and deformation are regressed separately, each by several experts: in the axes of the body, in axes
turned to the contact's azimuth, and in those of the contact itself, with and without a term that is linear in the
force. Which of them is right depends on the body's symmetry. Their predictions are blended with non-negative weights
that fit the validation motions best, and each training motion from all others (stacking; Breiman 1996).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.optimize import nnls

from odeform.arrays import in_steps, row_steps
from odeform.dataset.training_data import ROUNDING
from odeform.models.contact.inputs import FRAMES, ContactInputs
from odeform.models.kernels.likelihood import fit_kernel, ridge_of
from odeform.models.kernels.regression import KernelRegression
from odeform.models.residual import PARTS
from odeform.types import Arrays, Floats, Rotations

__all__ = ["ContactRegression", "fit_contact_regression"]

EXPERTS = (("body", False), ("body", True), ("azimuth", True), ("normal", True), ("normal", False))
"""Frame of inputs and outputs, and whether a term is linear in the force."""
ENERGY = 0.99999  # of deformations, in the modes of their trajectories
INPUTS = ("contact", "normal", "force")
MOST = 400  # training motions from which a kernel is chosen; all of them are regressed


Motions = Float[np.ndarray, "sequences times y"]
Asked = Float[np.ndarray, "asked times y"]


@dataclass(frozen=True, eq=False)
class _Scaling:
    """Inputs of about unit size: positions and normals by mean and deviation, all else by its root mean square."""

    frame: str
    shift: Floats
    scale: Floats
    force: float

    @classmethod
    def of(cls, inputs: ContactInputs, frame: str) -> "_Scaling":
        """The scaling under which the training inputs have unit size."""
        groups, force = inputs.features(frame)
        centred = 1 if frame == "body" else 2
        shifts = [group.mean(axis=0) * (index < centred) for index, group in enumerate(groups)]
        sizes = [np.sqrt(((g - s) ** 2).mean(axis=0)) for g, s in zip(groups, shifts, strict=True)]
        scales = [s if index < centred else np.full(len(s), np.sqrt((s**2).mean())) for index, s in enumerate(sizes)]
        scale = np.maximum(np.concatenate(scales), 1e-9)
        return cls(frame, np.concatenate(shifts), scale, float(np.sqrt((force**2).mean())))

    @property
    def places(self) -> int:
        """The number of first inputs that say where the contact is."""
        return 3 if self.frame == "body" else 6

    def __call__(self, inputs: ContactInputs) -> Floats:
        """(S, D + 3): inputs, and the force."""
        groups, force = inputs.features(self.frame)
        return np.concatenate([(np.concatenate(groups, axis=1) - self.shift) / self.scale, force / self.force], axis=1)


@dataclass(frozen=True, eq=False)
class _Expert:
    """One regression of outputs (M,) in its frame: what they differ by from their `mean` (M,). `logs` are the settings
    of its kernel, as `ridge_of` reads them."""

    scaling: _Scaling
    logs: Floats
    regression: KernelRegression
    mean: Floats

    def predict(self, scaled: Floats, inputs: ContactInputs, turned: bool) -> Floats:
        """(R, M) outputs at inputs, by its scaling and as they are; with `turned`, three-vectors, carried from the
        expert's frame to the axes of the body."""
        values = self.regression(scaled) + self.mean
        return _turned_back(values, inputs.frames(self.scaling.frame)) if turned else values


def _turned_back(values: Floats, frames: Rotations) -> Floats:
    """Three-vectors (S, M) carried from frames (S, 3, 3) to the axes of the body."""
    return np.einsum("sij,sti->stj", frames, values.reshape(len(values), -1, 3)).reshape(len(values), -1)


def _fitted(
    known: ContactInputs, outputs: Floats, frame: str, linear: bool, turned: bool
) -> tuple[_Expert, Float[np.ndarray, "sequences outputs"]]:
    """An expert on outputs (S, M) in the axes of the body, and its prediction of each from all others."""
    scaling, frames = _Scaling.of(known, frame), known.frames(frame)
    given = _turned_back(outputs, frames.swapaxes(1, 2)) if turned else outputs
    mean = given.mean(axis=0)
    x, places = scaling(known), scaling.places if linear else 0
    size = x.shape[1] - 3
    logs = fit_kernel(x[:MOST, :size], x[:MOST, size:], (given - mean)[:MOST], places)
    left_out, regression = ridge_of(logs, size, places).leave_one_out(x, given - mean)
    others = given - left_out
    return _Expert(scaling, logs, regression, mean), _turned_back(others, frames) if turned else others


class ContactRegression:
    """Reduced motions (T, 6 + K) from contacts and forces, by blended experts."""

    def __init__(self, arrays: Arrays, settings: Mapping[str, Any]) -> None:
        """Reads what `fit_contact_regression` returns. `KeyError` where something is missing."""
        self._known = ContactInputs(*(arrays[f"gp.{name}"].astype(float) for name in INPUTS))
        self._frames = len(arrays["times"])
        self._modes = arrays["gp.modes"].astype(np.float32)  # read whole for each push, and stored with less
        # of all experts in a frame, since these know the same motions
        self._scalings = {frame: _Scaling.of(self._known, frame) for frame in FRAMES}
        blend = settings["blend"]
        self._experts = {
            part: [(weight, self._expert(arrays, part, index)) for index, weight in enumerate(blend[part]) if weight]
            for part in PARTS
        }

    def _expert(self, arrays: Arrays, part: str, index: int) -> _Expert:
        """Reads the kernel of an expert and solves for its weights; older checkpoints hold them."""
        (frame, linear), name = EXPERTS[index], f"gp.{part}.{index}"
        scaling, logs = self._scalings[frame], arrays[f"{name}.logs"].astype(float)
        ridge, x = ridge_of(logs, len(scaling.scale), scaling.places if linear else 0), scaling(self._known)
        if f"{name}.weights" in arrays:
            regression = KernelRegression(ridge.kernel, x, arrays[f"{name}.weights"].astype(float))
            return _Expert(scaling, logs, regression, arrays[f"{name}.mean"].astype(float))
        given = arrays[f"gp.{part}.outputs"].astype(float)
        if part != "deformation":
            given = _turned_back(given, self._known.frames(frame).swapaxes(1, 2))
        mean = given.mean(axis=0)
        return _Expert(scaling, logs, ridge.fit(x, given - mean), mean)

    def predict(self, inputs: ContactInputs) -> Float[np.ndarray, "sequences times y"]:
        """Predicts the motions of S contacts."""
        parts, scaled = [], {frame: scaling(inputs) for frame, scaling in self._scalings.items()}
        for part, experts in self._experts.items():
            turned = part != "deformation"
            # all weights may be zero
            values = np.zeros((len(inputs.contact), 3 * self._frames if turned else len(self._modes)))
            for weight, expert in experts:
                values += weight * expert.predict(scaled[expert.scaling.frame], inputs, turned)
            flat = values if turned else (values.astype(np.float32) @ self._modes).astype(float)
            parts.append(flat.reshape(len(values), self._frames, -1))
        return np.concatenate(parts, axis=2)


def fit_contact_regression(
    known: ContactInputs, asked: ContactInputs, times: Floats, train: Motions, val: Asked, energy: float = ENERGY
) -> tuple[Arrays, dict[str, Any]]:
    """Fits the arrays and settings of a checkpoint, from training and validation motions (S, T, 6 + K), times (T,) and
    inputs.

    Kernels maximise the marginal likelihood; validation sets the blend. Modes of the trajectories of deformation hold
    the fraction `energy` of them. The setting `errors` has, for each part, the root of the mean squared norm of what
    trajectories miss, in training motions as predicted from all others and in validation motions together.
    """
    flat = {"train": _parts(train), "val": _parts(val)}
    modes = _modes(flat["train"]["deformation"], energy)
    for split in flat:
        flat[split]["deformation"] = flat[split]["deformation"] @ modes.T
    sizes = np.sqrt((flat["train"]["deformation"] ** 2).mean(axis=0))
    # a displacement is the sum of all coefficients of a frame, over three axes
    steps = row_steps(sizes, ROUNDING * np.sqrt(3.0 * len(times) / modes.shape[1]))
    arrays: Arrays = {"times": times, **in_steps("gp.modes", modes, steps)}
    arrays |= {f"gp.{name}": getattr(known, name) for name in INPUTS}
    even = np.full(len(train), ROUNDING)
    for part, outputs in flat["train"].items():
        arrays |= in_steps(f"gp.{part}.outputs", outputs, even)
    blend, left, trials = {}, {}, []
    for part in PARTS:
        turned = part != "deformation"
        fitted = [_fitted(known, flat["train"][part], frame, linear, turned) for frame, linear in EXPERTS]
        truth = np.concatenate([flat["train"][part], flat["val"][part]])
        predicted = [np.concatenate([others, e.predict(e.scaling(asked), asked, turned)]) for e, others in fitted]
        errors = [float(np.sqrt(((p - truth)[len(flat["train"][part]) :] ** 2).mean())) for p in predicted]
        blend[part] = _blend(predicted, truth, errors)
        residual = np.tensordot(blend[part], predicted, axes=1) - truth
        left[part] = float(np.sqrt((residual**2).sum() / len(truth)))
        for index, (expert, _) in enumerate(fitted):
            trials.append({"part": part, "expert": EXPERTS[index], "val": errors[index]})
            if blend[part][index]:
                arrays[f"gp.{part}.{index}.logs"] = expert.logs
    return arrays, {"blend": blend, "errors": left, "trials": trials}


def _blend(predicted: list[Floats], truth: Floats, errors: list[float]) -> list[float]:
    """The weight of each expert. The best one alone where nothing moves."""
    weights = nnls(np.stack([p.ravel() for p in predicted], axis=1), truth.ravel())[0]
    best = int(np.argmin(errors))
    return weights.tolist() if weights.any() else [float(index == best) for index in range(len(errors))]


def _parts(reduced: Floats) -> dict[str, Floats]:
    """Shift, rotation and deformation of motions (S, T, 6 + K), each flat (S, M)."""
    return {part: reduced[..., columns].reshape(len(reduced), -1) for part, columns in PARTS.items()}


def _modes(flat: Floats, fraction: float) -> Floats:
    """(M, T K) the leading modes of trajectories of deformation."""
    _, s, vt = np.linalg.svd(flat, full_matrices=False)
    energy = np.cumsum(s**2)
    return vt[: int(np.searchsorted(energy, fraction * energy[-1])) + 1]
