"""The authors' networks in the page, beside an imported truth."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from authors import TETRAHEDRON, Authors, write_sequence

from odeform.cli import main
from odeform.dataset.importers.registry import import_dataset
from odeform.types import Mesh
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.cli import make_columns
from odeform_viz.columns import Columns, truth_column
from odeform_viz.session import Session
from odeform_viz.view import ViewRequest

Serve = Callable[..., tuple[App, LoopbackClient]]

CORNERS = 0.1 * np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])


@pytest.fixture
def checkpoint(tmp_path: Path) -> str:
    return str(Authors("pemlp", 1).save(tmp_path / "a.pth"))


@pytest.fixture
def drops(tmp_path: Path) -> Path:
    """Three sequences of 60 frames that follow the network's window."""
    for k in range(5):
        params = {"mass": 0.5 + 0.1 * k, "soft_body_parameters": {"spring": {"bending": 1.0}}}
        write_sequence(tmp_path / "src", f"s{k}", np.tile(CORNERS, (60, 1, 1)), np.linspace(0.6, 0.1, 60), params)
    return import_dataset(tmp_path / "src", tmp_path / "drops").root


def test_labels_say_that_a_ball_is_shown(checkpoint: str, tmp_path: Path) -> None:
    (column,) = make_columns(checkpoint, (), None)
    assert "shown on a ball" in column.label
    file = tmp_path / "body.ply"
    trimesh.Trimesh(CORNERS, TETRAHEDRON, process=False).export(file)
    (column,) = make_columns(checkpoint, (), str(file))
    assert column.label == "authors' network"
    assert np.allclose(column.geometry.points, CORNERS), "as it is, not scaled to a ball"


def test_serves_a_network(serve: Serve, checkpoint: str) -> None:
    app, _ = serve(*make_columns(checkpoint, (), None), moment=2.4)
    assert app.session.schema.scene == "released-mass-elastic"


def test_the_truth_is_compared_in_its_own_frame(checkpoint: str, drops: Path) -> None:
    (column,) = make_columns(checkpoint, (), None)
    truth = truth_column(f"{drops}/s1")
    record = truth.truth
    assert record is not None
    assert record.setting == pytest.approx({"mass": 0.6, "bending": 1.0, "initial_offset": 0.6})
    session = Session(column.source.schema)
    request = ViewRequest(session.schema.complete(record.setting), 2.5, "balanced", Columns.of((column, truth)).all)
    error = session.frame(request).columns[0].error
    assert error is not None
    assert column.predictor is not None
    predicted = column.predictor.solve(Mesh(CORNERS, TETRAHEDRON), record.setting).vertices(2.5)
    off = predicted - record.vertices(2.5)
    assert error.rmse_mm == pytest.approx(1e3 * np.sqrt((off**2).mean()), rel=1e-4)


def test_evaluate_scores_the_trained_window(
    checkpoint: str, drops: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "scores.json"
    assert main(["evaluate", checkpoint, "--data", str(drops), "--split", "all", "--json", str(out)]) == 0
    scores = json.loads(out.read_text())["models"]["released"]
    assert len(scores["per_frame_rmse_mm"]) == 20
    assert main(["evaluate", checkpoint, "--data", str(drops), "--window", "0:30"]) == 2
    assert "covers only 2 to 2.95 s" in capsys.readouterr().err
    assert main(["stress", checkpoint]) == main(["bench", checkpoint]) == 2
