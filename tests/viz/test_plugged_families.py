"""A family with a vector field of one's own in the viewer, beside a bundled model."""

import dataclasses
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import odeform
from odeform.models import plugins
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.cli import make_columns
from odeform_viz.columns import Columns
from odeform_viz.panels.status import describe_column
from odeform_viz.session import Session
from odeform_viz.view import ViewRequest

PLUGIN = '''
"""y' = w(theta) (y_end(theta) - y): a motion that fades out."""

import torch
from torch import nn

import odeform


class Fading(nn.Module):
    def __init__(self, parameters: int, coordinates: int) -> None:
        super().__init__()
        self.end = nn.Linear(parameters, coordinates)
        nn.init.uniform_(self.end.weight, -0.1, 0.1)
        nn.init.zeros_(self.end.bias)

    def initial_state(self, theta: torch.Tensor) -> torch.Tensor:
        return torch.zeros_like(self.end(theta))

    def vector_field(self, t: float, z: torch.Tensor, theta: torch.Tensor) -> torch.Tensor:
        return 5.0 * (self.end(theta) - z)

    def readout(self, t: torch.Tensor, z: torch.Tensor, theta: torch.Tensor) -> torch.Tensor:
        return z


class FadingModel(odeform.NeuralModel):
    model, network = "fading", Fading


odeform.register_model("fading", FadingModel)
'''


@pytest.fixture
def checkpoint(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A checkpoint of the family, whose file is plugged in as `--plugin` does it."""
    monkeypatch.setenv(plugins.FILES, "")
    file = tmp_path / "fading_family.py"
    file.write_text(PLUGIN)
    plugins.load_plugin(file)
    assert str(file) in os.environ[plugins.FILES]
    dataset = odeform.open_dataset("mass-elastic")
    few = dataclasses.replace(dataset, entries=dataset.entries[::20])
    fitted = odeform.fit(few, "fading", steps=3, window=(0, 61), every=4, report=lambda _: None)
    fitted.save(tmp_path / "fading.safetensors")
    return tmp_path / "fading.safetensors"


def test_it_stands_beside_a_bundled_model(checkpoint: Path) -> None:
    columns = Columns.of(make_columns("mass-elastic", [str(checkpoint)], None)).all
    assert [column.predictor.model for column in columns if column.predictor] == ["latent", "fading"]
    session = Session(columns[0].source.schema)
    request = ViewRequest(session.schema.complete({"mass": 0.4}), 0.1, "balanced", columns)
    bundled, own = session.frame(request).columns
    rest = np.asarray(own.column.geometry.points)
    for shown in (bundled, own):
        assert shown.stats.status == "ok"
        moved = shown.motion.vertices(0.1) - rest
        assert 1e-4 < np.abs(moved).max() < 1.0  # metres
    assert not np.allclose(bundled.motion.vertices(0.1), own.motion.vertices(0.1))
    assert "**fading**" in describe_column(own, 0.1)
    assert "solver error" in describe_column(own, 0.1)
    heavier = dataclasses.replace(request, parameters=session.schema.complete({"mass": 0.9}))
    changed = session.frame(heavier).columns[1]
    assert not np.array_equal(changed.motion.vertices(0.1), own.motion.vertices(0.1))
    expected = odeform.load(checkpoint).solve(parameters={"mass": 0.9}).vertices(0.1)
    assert np.array_equal(changed.motion.vertices(0.1), expected)


@pytest.mark.slow
def test_the_page_shows_it_and_its_sliders_move_it(
    checkpoint: Path, serve: Callable[..., tuple[App, LoopbackClient]]
) -> None:
    app, client = serve(*make_columns("mass-elastic", [str(checkpoint)], None), moment=0.1)
    client.set("mass (kg)", 0.9)

    def own() -> np.ndarray | None:
        """What is shown of it once both columns are there."""
        frame = app.presenter.frame
        if frame is None or frame.request.parameters["mass"] != 0.9 or len(frame.columns) < 2:
            return None
        return frame.columns[1].motion.vertices(0.1)

    assert client.until(lambda: own() is not None)
    shown = own()
    assert shown is not None
    assert np.array_equal(shown, odeform.load(checkpoint).solve(parameters={"mass": 0.9}).vertices(0.1))
