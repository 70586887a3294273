"""How far the mechanics of objects is from the special models of the ball, on the ball's own drops and kicks.

`python -m odeform_figures.studies.ball` makes an elastic body of the ball of each motion, as the simulator has it: a
shell with the scene's mass and bending stiffness. Six contact parameters are fitted to training motions, as for
objects, and all models are measured on the same test motions.
"""

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import trimesh
from scipy.optimize import least_squares

from odeform.dataset.index import Dataset
from odeform.dataset.store import open_dataset
from odeform.geometry.contact import nearest_on
from odeform.geometry.rigid import rotation_z
from odeform.loads.drop import LOAD as DROP
from odeform.loads.load import Load
from odeform.loads.registry import register_load
from odeform.loads.situation import Flight, Pulse, Situation
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.models.modal.model import ModalModel
from odeform.models.modal.training.impact_fit import FITTED, Impact, predicted
from odeform.models.modal.user_body import UserBodyPredictor, resting_body
from odeform.models.registry import load
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.schema import Parameter, Parameters, Window
from odeform.simulation.material import damping_time, wall_thickness
from odeform.simulation.objects.ball import MATERIAL, RADIUS, relaxed, sphere
from odeform.simulation.objects.settling import settle
from odeform.simulation.objects.soft_object import SoftMaterial, SoftObject
from odeform.simulation.scenes.kick import PULSE, SPREAD, pulse_direction
from odeform.simulation.scenes.mass_elastic import HEIGHT
from odeform.types import Floats, Frames, Mesh
from odeform_figures.output import write_or_print
from odeform_figures.studies.loads import relative_errors

__all__ = ["ball", "measured"]

LIKE = "pillow"  # whose contact parameters the fit begins with, but for its factors on stiffness and damping
EVALUATIONS, STEP = 8, 0.05
SPECIAL = {"mass-elastic": ("mass-elastic/odeform-rolling", "mass-elastic"), "kick": ("kick",)}
AFTER = {"mass-elastic": 0.8, "kick": 0.5}  # s after the first contact, as for objects


def ball(mass: float, bending: float) -> SoftObject:
    """The ball of a mass in kg and a bending stiffness in N m, as it rests on the floor."""
    thickness = wall_thickness(bending, MATERIAL)
    reference, _ = relaxed(sphere(), RADIUS, thickness, MATERIAL)
    area = float(trimesh.Trimesh(reference.points, reference.faces, process=False).area)
    material = SoftMaterial(
        MATERIAL.young,
        MATERIAL.poisson,
        mass / (area * thickness),
        damping_time(thickness, MATERIAL),
        MATERIAL.friction,
        "the scene's",
        thickness,
    )
    points, faces = np.asarray(reference.points, dtype=float), np.asarray(reference.faces, dtype=np.int64)
    settled = settle(points, faces, material)
    return SoftObject("ball", points, faces, faces, settled, material, (1.0, 160.0), 2.0 * RADIUS)


def _kicked(rest: Mesh, parameters: Parameters) -> Situation:
    """The pulse of the scene `kick`, before it is turned to its azimuth: on a patch of the same width in angle."""
    direction = pulse_direction(float(parameters["elevation"]))
    middle = 0.5 * (rest.points.min(axis=0) + rest.points.max(axis=0))
    place = nearest_on(rest, middle - RADIUS * direction)
    return Situation(pulse=Pulse(place, float(parameters["force"]) * direction, PULSE, RADIUS * SPREAD))


def _fallen(rest: Mesh, parameters: Parameters) -> Situation:
    return Situation(flight=Flight(HEIGHT - RADIUS))


NONE = tuple(Parameter(name, "", -1e3, 1e3, 0.0) for name in ("force", "elevation"))
LOADS = {
    "mass-elastic": replace(DROP, name="ball-drop", parameters=(), situation=_fallen, presets={}),
    "kick": Load("ball-kick", "Kick", NONE, Window(0.0, 1.0, 120.0), 1.0, _kicked, pulse=PULSE),
}


@dataclass(frozen=True, eq=False)
class _Motion:
    """A motion of the ball from its first contact on, and the mechanics of that very ball."""

    impact: Impact
    rest: Mesh
    model: ModalModel
    evaluated: EvaluatedBasis

    def points(self, parameters: ContactParameters | None = None, frames: int | None = None) -> Frames:
        model = self.model if parameters is None else self.model.with_contact_parameters(parameters)
        count = len(self.impact.times) - self.impact.first - 1 if frames is None else frames
        turn = rotation_z(self.impact.parameters.get("azimuth", 0.0))  # the simulator's mesh turns with the kick
        return predicted(model, self.impact, self.evaluated, count) @ turn.T


def _motions(dataset: Dataset, split: str, count: int, acting: Load) -> list[_Motion]:
    """The first motions of a split."""
    scene, trained, out = dataset.schema.scene, load("contact-force"), []
    for entry in [one for one in dataset.entries if one.split == split][:count]:
        sequence = dataset.read(entry)
        rate = 100.0
        known = sequence.frames(min(float(sequence.times[-1]), 1.25), rate)
        vertices = known.vertices.astype(float)
        low = vertices[:, :, 2].min(axis=1)
        first = 0 if scene == "kick" else int((low < 5e-4).argmax())
        stop = first + round(AFTER[scene] * rate) + 1
        impact = Impact(sequence.parameters, known.times[:stop], vertices[:stop], sequence.weights, first)
        body = resting_body(ball(sequence.parameters["mass"], sequence.parameters["bending"]), LIKE)
        model = UserBodyPredictor(trained, body).under(acting.name)
        assert isinstance(model, ModalModel)
        own = replace(model.contact_parameters, stiffness=1.0, damping=1.0, floor_friction=MATERIAL.friction)
        model = model.with_contact_parameters(own)
        out.append(_Motion(impact, sequence.rest, model, model.evaluate_basis(model.rest, 0.0)))
    return out


def _fitted(motions: Sequence[_Motion]) -> ContactParameters:
    """Six contact parameters under which the first 120 ms after contact are followed best."""
    given = motions[0].model.contact_parameters
    centre, firm = np.log([getattr(given, name) for name in FITTED]), np.array(list(FITTED.values()))

    def parameters(x: Floats) -> ContactParameters:
        return replace(given, **dict(zip(FITTED, np.exp(x).tolist(), strict=True)))

    def residuals(x: Floats) -> Floats:
        found = [
            (one.points(parameters(x), 12) - (truth := one.impact.vertices[one.impact.first :][:13]))
            / (one.impact.size(12) * np.sqrt(truth.shape[0] * truth.shape[1]))
            for one in motions
        ]
        return np.concatenate([firm * (x - centre), *(np.nan_to_num(each, nan=1.0).ravel() for each in found)])

    found = least_squares(residuals, centre, diff_step=STEP, max_nfev=EVALUATIONS, x_scale=np.full(len(centre), 0.5))
    return parameters(found.x)


def measured(scene: str, train: int, test: int) -> dict[str, Any]:
    """Errors of all models on the same test motions of a scene, relative to the displacement since the first contact,
    and what a new motion takes."""
    acting, dataset = LOADS[scene], open_dataset(scene)
    register_load(acting)
    known, asked = (_motions(dataset, split, count, acting) for split, count in (("train", train), ("test", test)))
    fitted = _fitted(known)
    rows = {"mechanics, not fitted": [relative_errors(one.impact, one.points()) for one in asked]}
    rows["mechanics"] = [relative_errors(one.impact, one.points(fitted)) for one in asked]
    times: dict[str, list[float]] = {name: [] for name in rows}
    for name, parameters in zip(rows, (None, fitted), strict=True):
        for one in asked:
            begin = time.process_time()
            one.points(parameters)
            times[name].append(time.process_time() - begin)
    for name in SPECIAL[scene]:
        model, rows[name], times[name] = load(name), [], []
        for one in asked:
            begin, moments = time.process_time(), one.impact.times[one.impact.first :]
            points = model.solve(one.rest, one.impact.parameters).vertices(moments)
            times[name].append(time.process_time() - begin)
            rows[name].append(relative_errors(one.impact, np.asarray(points, dtype=float)))
    return {
        "motions": len(asked),
        "fitted to": len(known),
        "contact": fitted.to_json(),
        "models": {
            name: {key: round(float(np.mean([row[key] for row in each])), 4) for key in each[0]}
            | {"ms": round(1e3 * float(np.median(times[name])), 1)}
            for name, each in rows.items()
        },
    }


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.studies.ball", description=__doc__)
    parser.add_argument("--train", type=int, default=16, help="motions of each scene that contacts are fitted to")
    parser.add_argument("--test", type=int, default=24)
    parser.add_argument("--scene", nargs="+", default=list(LOADS), choices=list(LOADS))
    parser.add_argument("--out", help="write figures to this file")
    given = parser.parse_args()
    write_or_print({scene: measured(scene, given.train, given.test) for scene in given.scene}, given.out)


if __name__ == "__main__":
    main()
