"""Whether predicted motions within the trained box look like motions of a body. The scene says which checks apply."""

import numpy as np

from odeform.models.base import Predictor
from odeform.schema import Parameters
from odeform.simulation.physics import STANDARD_CHECKS, SampledMotion
from odeform.simulation.scenes.registry import find_scene
from odeform.stress.cases import inside
from odeform.stress.check import Check, Checks

__all__ = ["check_physics"]

SAMPLES = 24


def check_physics(predictor: Predictor, seed: int = 0) -> Checks:
    """Finds the worst figure of each of the scene's checks, over random motions at the trained frames."""
    scene = find_scene(predictor.schema.scene)
    checks = scene.checks if scene is not None else STANDARD_CHECKS
    worst: dict[str, float | int] = {}
    for parameters in inside(predictor.schema, SAMPLES, seed):
        motion = _sampled(predictor, parameters)
        for check in checks:
            figure = check.figure(motion)
            if figure is not None:
                worst[check.name] = max(worst.get(check.name, 0), figure)
    return {check.name: Check(worst[check.name], check.bound) for check in checks if check.name in worst}


def _sampled(predictor: Predictor, parameters: Parameters) -> SampledMotion:
    times = predictor.schema.window.times
    fine = np.linspace(times[0], times[-1], 4 * len(times) - 3)
    motion = predictor.solve(None, parameters)
    local = np.stack([motion.local(float(time)) for time in times])
    return SampledMotion(predictor.rest, times, local, motion.vertices(times), fine, motion.pose(fine))
