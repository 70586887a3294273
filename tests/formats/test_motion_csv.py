"""Curves as a table, against the motion and its predictor."""

import csv
from pathlib import Path

import numpy as np
import pytest

from odeform.dataset.recorded import read_recorded
from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.formats.motion_csv import COLUMNS, ERRORS
from odeform.formats.writing import write_motion
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.motion.base import Motion
from odeform.motion.recorded import RecordedMotion
from odeform.types import Floats, Mesh


def read(path: Path, motion: Motion, times: Floats) -> list[dict[str, str]]:
    write_motion(motion, times, path)
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == COLUMNS
    assert len(rows) == len(times)
    return rows


def column(rows: list[dict[str, str]], name: str) -> Floats:
    return np.array([float(row[name]) for row in rows])


@pytest.mark.parametrize("checkpoint", ["kick", "contact-force"])
def test_the_curves_of_a_motion(checkpoint: str, tmp_path: Path) -> None:
    predictor = load(checkpoint)
    motion = predictor.solve()
    times = predictor.schema.window.times
    rows = read(tmp_path / "a.csv", motion, times)
    assert np.allclose(column(rows, "time_s"), times)
    centre = motion.geometry.points.mean(axis=0)
    for axis, name in enumerate(("center_x_m", "center_y_m", "center_z_m")):
        moved = [motion.pose(float(t))[axis] @ [*centre, 1.0] for t in times]
        assert np.allclose(column(rows, name), moved, atol=1e-6)
    assert np.allclose(column(rows, "deformation_rms_mm"), 1e3 * motion.deformation_rms(times), rtol=1e-5, atol=1e-6)
    trace = np.trace(motion.pose(times)[:, :3, :3], axis1=1, axis2=2)
    assert np.allclose(np.cos(np.radians(column(rows, "rotation_deg"))), 0.5 * (trace - 1.0), atol=1e-6)
    band = motion.error_band(times)
    assert band is not None
    assert np.allclose(column(rows, "expected_error_median_mm"), band[:, 0], rtol=1e-6)
    assert np.allclose(column(rows, "expected_error_90_mm"), band[:, 1], rtol=1e-6)
    assert {row["status"] for row in rows} == {"ok"}
    assert {row["notes"] for row in rows} == {""}


def test_turns_are_counted_between_distant_rows(kick: Predictor, tmp_path: Path) -> None:
    motion = kick.solve()
    fine = read(tmp_path / "fine.csv", motion, kick.schema.window.times)
    coarse = read(tmp_path / "coarse.csv", motion, np.array([1.0, 0.0]))
    assert column(fine, "rotation_deg").max() > 180.0
    assert column(coarse, "rotation_deg") == pytest.approx([float(fine[-1]["rotation_deg"]), 0.0], abs=1e-3)


def test_what_is_outside_is_in_its_rows(kick: Predictor, tmp_path: Path) -> None:
    motion = kick.solve(parameters={"mass": 1.9})
    inside, late = read(tmp_path / "a.csv", motion, np.array([0.5, 1.2]))
    assert inside["status"].split() == ["outside-parameters"]
    assert late["status"].split()[:2] == ["outside-parameters", "outside-window"]
    assert "mass = 1.9 kg is outside the trained range" in inside["notes"]
    assert "t = 1.2 s is outside the trained window" in late["notes"]
    assert "outside the trained window" not in inside["notes"]


def test_errors_of_a_shape_that_was_not_trained_are_empty(kick: Predictor, tmp_path: Path) -> None:
    stretched = Mesh(kick.rest.points * np.float32([1.0, 0.5, 1.0]), kick.rest.faces)
    (row,) = read(tmp_path / "a.csv", kick.solve(stretched), np.array([0.5]))
    assert row["status"] == "untrained-shape"
    assert row["expected_error_median_mm"] == row["expected_error_90_mm"] == ""
    assert row["notes"]


def test_errors_against_a_truth_are_those_of_its_vertices(tmp_path: Path) -> None:
    predictor = load("mass-elastic")
    whole = read_recorded(f"mass-elastic/{open_dataset('mass-elastic').select('test')[0].name}")
    truth = RecordedMotion(whole.schema, whole.sequence.until(0.4))  # which ends while the ball moves
    motion = predictor.solve(truth.geometry, predictor.schema.known(truth.setting))
    times = np.array([0.0, 0.3, truth.end, truth.end + 0.1])
    write_motion(motion, times, tmp_path / "a.csv", truth=truth)
    with (tmp_path / "a.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == COLUMNS + ERRORS
    off = motion.vertices(times[:3]).astype(float) - truth.vertices(times[:3])
    assert np.allclose(column(rows[:3], "error_rmse_mm"), 1e3 * np.sqrt((off**2).mean(axis=(1, 2))), rtol=1e-5)
    assert np.allclose(column(rows[:3], "error_mae_mm"), 1e3 * np.abs(off).mean(axis=(1, 2)), rtol=1e-5)
    assert np.allclose(column(rows[:3], "error_worst_mm"), 1e3 * np.linalg.norm(off, axis=2).max(axis=1), rtol=1e-5)
    assert float(rows[1]["error_rmse_mm"]) > 0.0
    assert [rows[3][name] for name in ERRORS] == ["", "", ""]
    with pytest.raises(InputError, match=r"errors against a truth are written to \.csv only"):
        write_motion(motion, times, tmp_path / "a.npz", truth=truth)
    assert not (tmp_path / "a.npz").exists()
