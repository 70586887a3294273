"""Hundreds of random inputs to all panels; `python -m odeform_viz.benchmark --soak` sends thousands."""

from pathlib import Path

import numpy as np
import pytest

from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform_viz.app import App
from odeform_viz.benchmark.soak import soak
from odeform_viz.columns import Column, truth_column
from odeform_viz.panels import truth
from odeform_viz.runtime import jobs


@pytest.mark.slow
def test_random_input_to_all_panels_breaks_nothing(
    drop: Predictor, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(truth, "simulate_motion", _refuse)
    rival = load("mass-elastic/pod-rbf")
    columns = [
        Column("odeform", drop, drop.rest, origin="mass-elastic"),
        Column("pod-rbf", rival, rival.rest, origin="mass-elastic/pod-rbf"),
        truth_column("mass-elastic/mass-elastic_00001"),
    ]
    app = App(columns, port=0)
    try:
        result = soak(app, 300, tmp_path, parts=2)
    finally:
        app.close()
    assert result.errors == ()
    assert np.isfinite(result.newest_s).all()
    assert result.requests == 300


def _refuse(report: jobs.Report, *_: object) -> None:
    raise RuntimeError("no simulator in this test")
