"""Hundreds of random inputs and all scripts; `python -m odeform_figures.viewer_benchmark --soak` runs for an hour."""

import time
from pathlib import Path

import numpy as np
import pytest

from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.types import MotionSequence
from odeform_figures.viewer_benchmark.allocated import allocated_mb
from odeform_figures.viewer_benchmark.soak import Soak, soak
from odeform_viz.app import App
from odeform_viz.columns import Column, truth_column
from odeform_viz.panels import truth
from odeform_viz.runtime import jobs

FRAMES = 600  # of a stub of a simulation, over its whole window


@pytest.mark.slow
def test_random_input_to_all_panels_breaks_nothing(
    drop: Predictor, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(truth, "simulate_motion", at_rest)
    rival = load("mass-elastic/pod-rbf")
    columns = [
        Column("odeform", drop, drop.rest, origin="mass-elastic"),
        Column("pod-rbf", rival, rival.rest, origin="mass-elastic/pod-rbf"),
        truth_column("mass-elastic/mass-elastic_00001"),
    ]
    app = App(columns, port=0, workspace=tmp_path)
    lines: list[str] = []
    try:
        result = soak(app, 200, tmp_path, parts=1, report=lines.append)
    finally:
        app.close()
    assert result.errors == ()
    assert np.isfinite(result.newest_s).all()
    assert result.requests > 200
    assert len(lines) == 1


def at_rest(report: jobs.Report, scene: str, parameters: dict[str, float], rate: float) -> MotionSequence:
    """In place of a simulation; in this module, for the job's process to find it."""
    rest = load(scene).rest
    frames = np.tile(rest.points, (FRAMES, 1, 1))
    weights = np.full(len(rest.points), 1.0 / len(rest.points), dtype=np.float32)
    time.sleep(2.0)  # there is something to cancel
    return MotionSequence(np.arange(FRAMES) / rate, frames, rest.faces, weights, parameters)


@pytest.mark.parametrize(
    ("errors", "newest", "resident", "passed"),
    [
        ((), (0.1, 0.1), (500.0, 505.0, 510.0), True),
        (("fit: expected within 60 s: estimates",), (0.1,), (500.0,), False),
        ((), (0.1, np.inf), (500.0, 500.0), False),
        ((), (0.1, 0.1), (500.0, 500.0, 530.0), False),
    ],
)
def test_a_soak_passes_within_its_bars(
    errors: tuple[str, ...], newest: tuple[float, ...], resident: tuple[float, ...], passed: bool
) -> None:
    assert Soak(100, 0, errors, newest, resident, (), 1.0).passed is passed


def test_what_is_allocated_is_compared_as_the_resident_memory_is() -> None:
    few = Soak(100, 0, (), (0.1,), (500.0, 700.0, 700.0, 700.0), (90.0, 100.0, 100.0, 101.0), 1.0)
    assert few.memory == (500.0, 700.0)
    assert few.allocated == (90.0, 101.0)
    assert Soak(100, 0, (), (0.1,), (500.0,), (), 1.0).allocated is None


@pytest.mark.skipif(allocated_mb() is None, reason="needs glibc")
def test_what_is_kept_is_counted_as_allocated() -> None:
    before = allocated_mb()
    kept = np.ones(5_000_000)
    between = allocated_mb()
    del kept
    after = allocated_mb()
    assert before is not None
    assert between is not None
    assert after is not None
    assert between - before > 35.0
    assert between - after > 35.0
