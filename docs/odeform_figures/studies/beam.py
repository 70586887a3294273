"""A silicone beam in motion capture, held against the mechanics of a clamped body.

    python -m odeform_figures.studies.beam RECORDING.npz
    python -m odeform_figures.studies.beam RECORDING.c3d --weight 52

The recording is one of github.com/srl-ethz/diffPD_sim2real (MIT): six markers on a beam of 30 x 30 x 100 mm that
is clamped at one end, held straight, and let go, without or with a weight at its upper edge. Places of the markers,
material and size are the authors'. Errors of the numbers, of the model and of the measurement stand side by side;
they are not summed.

    python -m odeform_figures.studies.beam --model beam.safetensors

writes the beam as a model of the page, without any recording: `odeform-viz --checkpoint beam.safetensors`, and *Open a
motion...* there.
"""

import argparse
import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from odeform.checkpoint import Checkpoint, write_checkpoint
from odeform.geometry.solids.block import block
from odeform.identification.clamped import (
    LOSSES,
    STEP,
    FittedSwing,
    MarkedBody,
    fit_swing,
    frequency_of,
    marked_body,
    predict_swing,
    static_young,
)
from odeform.identification.release import MarkerLayout, Release, read_markers, released
from odeform.mechanics.clamped import GRAVITY, ClampedBody, Weight, held_by_face
from odeform.mechanics.quadratic import Stiffness, quadratic_mesh
from odeform.models.clamped import clamped_checkpoint

__all__ = ["AUTHORS", "LAYOUT", "beam", "main", "model", "report"]

SIZE = (0.03, 0.03, 0.1)  # m: height, width, length
AUTHORS, POISSON, DENSITY = 263.8e3, 0.499, 1070.0  # Pa, and kg/m^3
CELLS, FINER = 3, 4  # across the beam
COARSE = (2, 2, 7)  # cells of the model of the page
TILT = np.radians(6.5)  # of gravity out of the beam's normal, as both recordings say
SHOWN = 2.0  # s
HEIGHT = 0.1  # m of the beam above the grid of the page
LAYOUT = MarkerLayout(
    tip={"Tip - 1": (0.036, 0.015, 0.1), "Tip - 2": (0.024, 0.036, 0.1), "Tip - 3": (0.006, -0.006, 0.1)},
    base={"Base - 1": (0.0, 0.04, 0.006), "Base - 2": (0.0275, -0.01, 0.006), "Base - 3": (-0.001, -0.01, 0.006)},
)
EDGE = np.stack([np.full(7, SIZE[0]), np.linspace(0.0, SIZE[1], 7), np.full(7, SIZE[2])], axis=1)
FITTED = 0.5  # s of the motion
BETWEEN = 1.5  # times the load


def beam(release: Release, grams: float = 0.0, cells: int = CELLS) -> ClampedBody:
    """The beam with the authors' material, `cells` cells across, and a weight on its upper edge."""
    counts = (cells, cells, round(cells * SIZE[2] / SIZE[0]))
    mesh = quadratic_mesh(*block(np.zeros(3), np.array(SIZE), counts))
    weights = [Weight(1e-3 * grams, EDGE)] if grams else []
    held = held_by_face(mesh, 2, low=True)
    return ClampedBody(Stiffness(mesh, AUTHORS, POISSON), DENSITY, held, GRAVITY * release.gravity, weights)


def model() -> Checkpoint:
    """The beam as a model of the page, in the axes of a scene: it lies along y, and z is up."""

    def placed(x: float, y: float, z: float) -> tuple[float, float, float]:
        return float(y), float(z), HEIGHT + float(x)

    points, elements = block(np.zeros(3), np.array(SIZE), COARSE)
    corners = np.array([placed(*point) for point in points])
    mesh = quadratic_mesh(corners, elements)
    markers = {
        "tip": {name: placed(*place) for name, place in LAYOUT.tip.items()},
        "base": {name: placed(*place) for name, place in LAYOUT.base.items()},
    }
    gravity = GRAVITY * np.array([0.0, np.sin(TILT), -np.cos(TILT)])
    edge = np.array([placed(*place) for place in EDGE])
    held = held_by_face(mesh, 1, low=True)
    made = clamped_checkpoint(corners, elements, held, (POISSON, DENSITY), gravity, edge, markers, SHOWN)
    provenance = {"command": ["python -m odeform_figures.studies.beam --model FILE"]}
    return replace(made, provenance=provenance)


@dataclass(frozen=True, eq=False)
class _Study:
    release: Release
    grams: float
    body: ClampedBody
    marked: MarkedBody
    fitted: FittedSwing
    law: str

    def depth(self, displacements: np.ndarray) -> np.ndarray:
        return np.nanmean(displacements @ self.release.gravity, axis=1)


def report(path: Path, grams: float) -> dict[str, float | str]:
    """Measures one recording; lengths in mm, stiffness in kPa, frequencies in Hz."""
    release = released(read_markers(path), LAYOUT)
    body = beam(release, grams)
    marked = marked_body(body, release)
    fits = {law: fit_swing(marked, release, law, FITTED) for law in LOSSES}
    law = min(fits, key=lambda name: fits[name].rms(rest=False))
    study = _Study(release, grams, body, marked, fits[law], law)
    return {
        "recording": path.stem,
        "weight_g": grams,
        **_static(study),
        **_moving(study),
        **_numbers(study),
        **_measured(study),
    }


def _static(study: _Study) -> dict[str, float]:
    release, body = study.release, study.body
    young = static_young(body, release)
    hangs = body.mesh.rows_at(release.places) @ body.static()
    sag = float((release.sag @ release.gravity).mean())
    return {
        "young_static_kpa": 1e-3 * young,
        "young_static_off_authors_percent": 100.0 * (young / AUTHORS - 1.0),
        "sag_measured_mm": 1e3 * sag,
        "sag_authors_young_off_percent": 100.0 * (float((hangs @ release.gravity).mean()) / sag - 1.0),
    }


def _moving(study: _Study) -> dict[str, float | str]:
    fitted, marked = study.fitted, study.marked
    measured = frequency_of(fitted.times, study.depth(fitted.measured))
    found = frequency_of(fitted.times, study.depth(fitted.predicted))
    with_authors = predict_swing(marked, AUTHORS, fitted.loss, fitted.beginning, fitted.times)
    authors = frequency_of(fitted.times, study.depth(with_authors))
    loss = {"viscous": 1e3 * fitted.loss.viscous, "lag": fitted.loss.lag, "time": 1e3 * fitted.loss.time}
    names = {"viscous": "viscous_ms", "lag": "lag", "time": "relaxation_ms"}
    return {
        "law": study.law,
        "young_fitted_kpa": 1e-3 * fitted.young,
        **{names[name]: loss[name] for name in LOSSES[study.law]},
        "frequency_measured_hz": measured,
        "frequency_fitted_off_percent": 100.0 * (found / measured - 1.0),
        "frequency_authors_young_off_percent": 100.0 * (authors / measured - 1.0),
        "rms_fitted_mm": 1e3 * fitted.rms(rest=False),
        "rms_rest_mm": 1e3 * fitted.rms(rest=True),
        "mean_of_rest_off_mm": 1e3 * float(np.linalg.norm(_mean_off(fitted))),
    }


def _mean_off(fitted: FittedSwing) -> np.ndarray:
    rest = fitted.times > fitted.until
    return np.nanmean(fitted.predicted[rest] - fitted.measured[rest], axis=(0, 1))


def _numbers(study: _Study) -> dict[str, float]:
    """By refinement: of the mesh, of the subspace and of the step."""
    fitted, marked, release = study.fitted, study.marked, study.release
    rows = study.body.mesh.rows_at(release.places)
    finer = beam(release, study.grams, FINER)
    whole, refined = rows @ study.body.static(), finer.mesh.rows_at(release.places) @ finer.static()
    # under a load of which the subspace has no solution
    between = rows @ study.body.static(BETWEEN, study.body.static())
    reduced = marked.rows @ marked.swinging.hanging(BETWEEN)[0]
    half = predict_swing(marked, fitted.young, fitted.loss, fitted.beginning, fitted.times, 0.5 * STEP)
    return {
        "mesh_changes_sag_percent": 100.0 * float((refined - whole).ravel() @ whole.ravel() / (whole**2).sum()),
        "subspace_changes_sag_mm": 1e3 * float(np.linalg.norm(reduced - between, axis=1).max()),
        "half_the_step_changes_mm": 1e3 * float(np.sqrt(((half - fitted.predicted) ** 2).sum(axis=2).mean())),
    }


def _measured(study: _Study) -> dict[str, float]:
    release = study.release
    return {
        "markers_beside_layout_mm": 1e3 * release.misfit,
        "base_moved_mm": 1e3 * release.base,
        "noise_mm": 1e3 * release.noise,
    }


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path, nargs="?")
    parser.add_argument("--model", type=Path, metavar="FILE", help="write a checkpoint of the beam for the page")
    parser.add_argument("--weight", type=float, default=0.0, help="grams on the upper edge of the tip")
    parser.add_argument("--out", type=Path, help="a .json file to add the figures to, by the name of the recording")
    args = parser.parse_args()
    if args.model:
        write_checkpoint(args.model, model())
    if args.recording is None:
        if args.model is None:
            parser.error("expected a recording, or --model")
        return
    found = report(args.recording, args.weight)
    for name, value in found.items():
        print(f"{name:42} {value if isinstance(value, str) else format(value, '.4g')}")
    if args.out:
        known = json.loads(args.out.read_text()) if args.out.exists() else {}
        rounded = {name: value if isinstance(value, str) else float(f"{value:.4g}") for name, value in found.items()}
        args.out.write_text(json.dumps({**known, found["recording"]: rounded}, indent=2) + "\n")


if __name__ == "__main__":
    main()
