"""How far pushed objects are right until they rest, and at half and twice their mass and stiffness.

Run `python -m odeform_figures.studies.rest`. Simulations take minutes; with `--keep FOLDER` they are used again.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from odeform.geometry.rigid import best_rigid, vector_from_rotation
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.schema import Parameters
from odeform.simulation.contacts import MASS, YOUNG
from odeform.simulation.errors import SimulationError
from odeform.simulation.objects.catalog import OBJECTS, get_object
from odeform.simulation.scenes.contact_force import sample, simulate_object
from odeform.types import Floats, Frames, Perpoint, Points
from odeform_figures.output import write_or_print

__all__ = ["Push", "compare", "simulate"]

SEED = 4242
UNTIL, CHANGED_UNTIL = 0.8, 0.3  # s, of usual objects and of changed ones
RATIOS = ((1, 1), (0.5, 1), (2, 1), (1, 0.5), (1, 2))
"""Of mass and of Young's modulus."""
AT = (0.05, 0.1, 0.19, 0.3, 0.5, 0.8)
"""s, of which errors are shown."""
PLACED = (0.01, 10.0)  # m and degrees


@dataclass(frozen=True, eq=False)
class Push:
    """One simulated push."""

    parameters: Parameters
    times: Floats
    """(T,) s."""
    vertices: Frames
    weights: Perpoint


def simulate(name: str, index: int, ratios: tuple[float, float], keep: Path | None = None) -> Push | None:
    """The push number `index` of an object with so many times its mass and stiffness; None where it fails."""
    path = None if keep is None else keep / f"{name}_{index}_{ratios[0]}_{ratios[1]}.npz"
    if path is not None and path.exists():
        with np.load(path, allow_pickle=False) as file:
            given = {key[2:]: file[key][()] for key in file if key.startswith("p_")}
            given = {key: str(value) if key == "object" else float(value) for key, value in given.items()}
            return Push(given, file["times"], file["vertices"], file["weights"])
    item = get_object(name)
    changed = {MASS: ratios[0] * item.mass, YOUNG: 1e-3 * ratios[1] * item.material.young}
    given = {"object": name, **sample(name, index + 1, SEED)[index], **changed}
    try:
        found = simulate_object(item, given, until=_until(ratios))
    except SimulationError:
        return None
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        named = {f"p_{key}": value for key, value in given.items()}
        np.savez(path, times=found.times, vertices=found.vertices, weights=found.weights, **named)
    return Push(given, found.times, found.vertices, found.weights)


def _until(ratios: tuple[float, float]) -> float:
    return UNTIL if ratios == (1, 1) else CHANGED_UNTIL


def _rms(off: Float[np.ndarray, "times points 3"], weights: Perpoint) -> Floats:
    """(T,) mm per coordinate."""
    return 1e3 * np.sqrt((off.astype(float) ** 2).sum(axis=2) @ weights / 3.0)


def _placed(truth: Points, predicted: Points, weights: Perpoint) -> bool:
    """Whether place and orientation of points (N, 3) m are within `PLACED`."""
    turn, shift = best_rigid(truth, predicted, weights / weights.sum())
    angle = np.degrees(np.linalg.norm(vector_from_rotation(turn[None])[0]))
    return bool(np.linalg.norm(shift) < PLACED[0] and angle < PLACED[1])


def compare(model: Predictor, pushes: list[Push], until: float) -> dict[str, Any]:
    """RMS error and RMS displacement in mm at `AT` up to `until` s, and their median ratio, over pushes of all objects;
    at the last of these times, how many are better than standing still, and have place and orientation within `PLACED`.
    A simulation that ended before had come to rest: its last frame holds."""
    at, rows = np.array([time for time in AT if time <= until + 1e-6]), []
    for push in pushes:
        frames = push.vertices[np.minimum(np.searchsorted(push.times, at - 1e-6), len(push.times) - 1)]
        predicted = model.solve(parameters=push.parameters, until=float(at[-1])).vertices(at)
        moved = _rms(frames - push.vertices[0], push.weights)
        placed = _placed(frames[-1], predicted[-1], push.weights)
        rows.append((push.parameters["object"], _rms(predicted - frames, push.weights), moved, placed))
    out: dict[str, Any] = {}
    for name in (*OBJECTS, "all"):
        some = [row for row in rows if name in (row[0], "all")]
        if some:
            errors, moved = (np.array([row[part] for row in some]) for part in (1, 2))
            pooled = [np.sqrt((values**2).mean(axis=0)) for values in (errors, moved)]
            out[name] = {
                "pushes": len(some),
                "times_s": at.tolist(),
                "rmse_mm": pooled[0].round(3).tolist(),
                "median_mm": np.median(errors, axis=0).round(3).tolist(),
                "displacement_mm": pooled[1].round(3).tolist(),
                "median_relative": np.median(errors / np.maximum(moved, 1e-9), axis=0).round(3).tolist(),
                "better_than_standing_still": int((errors[:, -1] < moved[:, -1]).sum()),
                "placed_at_the_end": sum(row[3] for row in some),
            }
    return out


def main() -> None:
    """Simulate, compare, and print."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.studies.rest", description=__doc__)
    parser.add_argument("--count", type=int, default=3, help="pushes of each object as it is (default: 3)")
    parser.add_argument("--changed", type=int, default=1, help="pushes of each changed object (default: 1)")
    parser.add_argument("--keep", type=Path, help="folder that keeps the simulations")
    parser.add_argument("--json", type=Path, help="write figures to this file")
    given = parser.parse_args()
    model, out = load("contact-force"), {}
    for ratios in RATIOS:
        count = given.count if ratios == (1, 1) else given.changed
        found = [simulate(name, index, ratios, given.keep) for index in range(count) for name in OBJECTS]
        pushes = [push for push in found if push is not None]
        out[f"mass x {ratios[0]}, stiffness x {ratios[1]}"] = compare(model, pushes, _until(ratios))
    write_or_print(out, given.json)


if __name__ == "__main__":
    main()
