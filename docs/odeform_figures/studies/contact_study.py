"""Is the simulation of `contact-force` sound? `python -m odeform_figures.studies.contact_study` answers, by object.

Prints JSON: how much halving the time step changes the displacement, how much a contact that is moved by 1 mm and a
force that is 2 % stronger do, how deep dents are, and how far bodies sink into the floor. The shipped figures are in
`assets/studies`.
"""

import argparse
import os
from typing import Any

import numpy as np

from odeform.geometry.contact import nearest_on
from odeform.geometry.rigid import best_rigid
from odeform.parallel import parallel_map
from odeform.schema import OBJECT, Parameters
from odeform.simulation.errors import SimulationError
from odeform.simulation.objects.catalog import OBJECTS, get_object
from odeform.simulation.scenes.contact_force import SCENE, contact_and_force, simulate
from odeform.types import Floats, MotionSequence
from odeform_figures.output import write_or_print

__all__ = ["main", "study"]

ASIDE = 1e-3  # m by which a contact is moved along the surface
STRONGER = 0.02  # fraction by which a force is raised


def study(count: int, seed: int, workers: int) -> dict[str, Any]:
    """The figures of `count` sequences of each object, drawn as for a data set with this seed."""
    settings = SCENE.sample(count, seed)
    jobs = [job for parameters in settings for job in _jobs(parameters)]
    motions = parallel_map("study contact-force", _run, jobs, workers)
    rows = [_row(p, *motions[4 * at : 4 * at + 4]) for at, p in enumerate(settings)]
    by_object = {name: _pooled([row for row in rows if row["parameters"][OBJECT] == name]) for name in OBJECTS}
    return {
        "scene": SCENE.schema.scene,
        "command": f"python -m odeform_figures.studies.contact_study --count {count} --seed {seed}",
        "step_ms": 1e3 * SCENE.step,
        "fixed": SCENE.fixed,
        "objects": by_object,
        "sequences": rows,
    }


def _jobs(parameters: Parameters) -> list[tuple[Parameters, float]]:
    """A motion, the same at half the step, with its contact moved, and with a stronger force."""
    rest = get_object(parameters[OBJECT]).rest_mesh()
    contact, force = contact_and_force(parameters)
    normal = nearest_on(rest, contact).normal
    across = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    moved = nearest_on(rest, contact + ASIDE * across / np.linalg.norm(across)).point
    return [
        (parameters, SCENE.step),
        (parameters, 0.5 * SCENE.step),
        ({**parameters, **_named("contact", moved)}, SCENE.step),
        ({**parameters, **_named("force", (1.0 + STRONGER) * force)}, SCENE.step),
    ]


def _named(name: str, vector: Floats) -> dict[str, float]:
    return {f"{name}_{axis}": float(x) for axis, x in zip("xyz", vector, strict=True)}


def _run(job: tuple[Parameters, float]) -> MotionSequence | str:
    parameters, step = job
    try:
        return simulate(parameters, step=step)
    except SimulationError as error:
        return str(error)


def _row(parameters: Parameters, *motions: MotionSequence | str) -> dict[str, Any]:
    """The figures of one sequence; `failed` is the first reason, if one of its motions is not sound."""
    sound = [motion for motion in motions if isinstance(motion, MotionSequence)]
    if len(sound) < len(motions):
        return {"parameters": dict(parameters), "failed": next(m for m in motions if isinstance(m, str))}
    vertices, halved, moved, stronger = (motion.vertices.astype(float) for motion in sound)
    return {
        "parameters": dict(parameters),
        "displacement_mm": 1e3 * _rms(vertices - vertices[0]),
        "halving_mm": 1e3 * _rms(vertices - halved),
        "moved_1_mm_mm": 1e3 * _rms(vertices - moved),
        "stronger_2_percent_mm": 1e3 * _rms(vertices - stronger),
        "dent": _dent(vertices, sound[0].weights) / get_object(parameters[OBJECT]).thickness,
        "penetration_mm": -1e3 * float(vertices[..., 2].min()),
    }


def _rms(difference: Floats) -> float:
    return float(np.sqrt((difference**2).sum(axis=-1).mean()))


def _dent(vertices: Floats, weights: Floats) -> float:
    """Metres: the largest distance of a vertex from the body's rigid motion."""
    rotation, shift = best_rigid(vertices[0], vertices, weights)
    centre = weights @ vertices[0]
    rigid = (vertices[0] - centre) @ rotation.swapaxes(1, 2) + (centre + shift)[:, None]
    return float(np.linalg.norm(vertices - rigid, axis=-1).max())


def _pooled(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """The figures of one object: RMS changes relative to the RMS displacement, and extremes."""
    sound = [row for row in rows if "failed" not in row]
    if not sound:
        return {"failed": len(rows)}
    square = {key: float(np.sqrt(np.mean([row[key] ** 2 for row in sound]))) for key in sound[0] if key.endswith("_mm")}
    displacement = square["displacement_mm"]
    return {
        "failed": len(rows) - len(sound),
        "displacement_mm": displacement,
        "halving": square["halving_mm"] / displacement,
        "moved_1_mm": square["moved_1_mm_mm"] / displacement,
        "stronger_2_percent": square["stronger_2_percent_mm"] / displacement,
        "largest_dent_of_thickness": max(row["dent"] for row in sound),
        "largest_penetration_mm": max(row["penetration_mm"] for row in sound),
    }


def main() -> None:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.studies.contact_study", description=__doc__)
    parser.add_argument("--count", type=int, default=3, metavar="N", help="sequences of each object (default: 3)")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="random seed of the parameters (default: 0)")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="W", help="number of processes")
    parser.add_argument("--json", metavar="FILE", help="write the result to this file instead of printing it")
    args = parser.parse_args()
    for option in ("count", "workers"):
        if (value := getattr(args, option)) < 1:
            parser.error(f"--{option}: expected at least 1, got {value}")
    write_or_print(study(args.count, args.seed, args.workers), args.json)


if __name__ == "__main__":
    main()
