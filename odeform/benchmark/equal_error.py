"""The simulator at the model's error: the comparison that learned simulators often omit (McGreivy & Hakim 2024)."""

import time
from typing import Any

import numpy as np

from odeform.benchmark.probes import nearest_sequences
from odeform.benchmark.timing import typical
from odeform.dataset.index import Dataset
from odeform.evaluation.metrics import evaluate
from odeform.models.model import Model
from odeform.motion.basis import fit_basis
from odeform.motion.reduced_space import decompose, rotation_of, to_canonical
from odeform.schema import Window
from odeform.simulation.errors import SimulationError
from odeform.simulation.scene import Scene
from odeform.simulation.scenes.registry import find_scene
from odeform.types import Floats, Frames, MotionSequence

__all__ = ["carried_over", "coarser_settings", "simulator"]

SIMULATED = 3  # sequences of the test split
STEPS = (1.0, 2.0, 4.0)
"""Time steps that are tried, in multiples of the scene's own. Coarser meshes are tried with fewer of them."""


def carried_over(coarse: MotionSequence, truth: MotionSequence, anchor: Floats, azimuth: float) -> Frames:
    """Transfer the motion of a coarse mesh to the rest vertices of a finer one; (T, N, 3) m.

    `anchor` is (3,) m. The rigid part is that of the coarse mesh, the deformation is the smoothest field through its
    vertices.
    """
    pose, local = decompose(coarse, anchor, azimuth)
    rest = to_canonical(truth.vertices[0], anchor, azimuth)
    scale = float(np.linalg.norm(rest, axis=1).mean())
    field = fit_basis(to_canonical(coarse.vertices[0], anchor, azimuth), local.transpose(1, 2, 0), scale)
    rotation, shift = rotation_of(pose, azimuth)
    moved = rest + field.values(rest).transpose(2, 0, 1)
    return moved @ rotation.swapaxes(1, 2) + shift[:, None] + anchor


def _on_frames(recorded: MotionSequence, window: Window) -> MotionSequence:
    """The frames of the window: test sequences have more."""
    return recorded.until(window.stop, round(1.0 / (window.rate * (recorded.times[1] - recorded.times[0]))))


def _model_ms(model: Model, truth: MotionSequence) -> float:
    """Milliseconds from parameters to all frames at the vertices of the truth."""
    times = model.schema.window.times
    return typical(lambda _: model.solve(truth.rest, truth.parameters).vertices(times), 15)


def coarser_settings(scene: Scene) -> list[tuple[float, int | None]]:
    """Time step in seconds and resolution of the simulations that are tried, that of the scene's truth first."""
    return [
        (factor * scene.step, resolution)
        for index, resolution in enumerate(scene.resolutions or (None,))
        for factor in STEPS[: max(len(STEPS) - index, 1)]
    ]


def _attempt(
    scene: Scene, model: Model, truths: list[MotionSequence], step: float, resolution: int | None
) -> dict[str, Any]:
    """Mean time and pooled error of the simulator at one setting."""
    window, errors, ms = model.schema.window, [], []
    numerics = {} if resolution is None else {"resolution": resolution}
    setting = {"step": step, "segments": resolution}
    for truth in truths:
        begin = time.perf_counter()
        try:
            simulated = scene.simulate(truth.parameters, rate=window.rate, step=step, **numerics)
        except SimulationError as error:
            return {**setting, "failed": str(error)}
        ms.append(1e3 * (time.perf_counter() - begin))
        azimuth = model.schema.azimuth(truth.parameters)
        moved = carried_over(simulated.until(window.stop), truth, model.space.anchor, azimuth)
        errors.append(((moved - truth.vertices)[1:] ** 2).mean())
    error_mm = float(1e3 * np.sqrt(np.mean(errors)))
    return {**setting, "ms": float(np.mean(ms)), "error_mm": error_mm}


def simulator(model: Model, dataset: Dataset | None) -> dict[str, Any]:
    """The simulator at the cheapest setting whose error against the truth is at most the model's.

    The first setting is that of the truth: its error comes from packing and from other processors. `pays_off_after` is
    the number of queries after which simulating the data set and training cost less than simulating every query.
    """
    if dataset is None:
        return {"skipped": f"no data set of scene {model.schema.scene}: give one with --data"}
    scene, window = find_scene(model.schema.scene), model.schema.window
    if scene is None:
        return {"skipped": f"scene {model.schema.scene} cannot be simulated"}
    if scene.fixed != dataset.fixed:
        return {"skipped": "the data set has other physics than this version simulates"}
    near = nearest_sequences(dataset, model.schema.complete(None), SIMULATED)
    truths = [_on_frames(recorded, window) for recorded in near.sequences("test")]
    model_error = evaluate(model, near, "test")["rmse_pooled_mm"]

    tried = [_attempt(scene, model, truths, *setting) for setting in coarser_settings(scene)]
    enough = [row for row in tried if row.get("error_mm", np.inf) <= model_error]
    equal, truth = min(enough, key=lambda row: row["ms"], default=tried[0]), tried[0]
    if "failed" in truth:
        return {"skipped": f"the simulation fails at the scene's own setting: {truth['failed']}"}
    ours = float(np.mean([_model_ms(model, t) for t in truths]))
    # ms for the data set and the training on it
    spent = len(dataset.entries) * truth["ms"] + 1e3 * model.checkpoint.provenance["training_seconds"]
    return {
        "points": truths[0].vertices.shape[1],
        "frames": len(window.times),
        "ms": equal["ms"],
        "ours_ms": ours,
        "speedup": equal["ms"] / ours,
        "error_mm": equal["error_mm"],
        "ours_error_mm": model_error,
        "step": equal["step"],
        "segments": equal["segments"],
        "sequences": [entry.name for entry in near.entries],
        "pays_off_after": int(np.ceil(spent / max(equal["ms"] - ours, 1e-9))),
        "tried": tried,
    }
