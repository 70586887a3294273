"""The beam as a model of the page."""

from pathlib import Path

import numpy as np
import pytest

import odeform
from odeform.models.clamped import ClampedModel
from odeform.types import PointCloud
from odeform_figures.studies.beam import AUTHORS, LAYOUT, SIZE, main


def test_the_beam_is_written_as_a_model_without_a_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", ["beam", "--model", str(path := tmp_path / "beam.safetensors")])
    main()
    beam = odeform.load(path)
    assert isinstance(beam, ClampedModel)
    assert np.ptp(beam.rest.points, axis=0) == pytest.approx([SIZE[1], SIZE[2], SIZE[0]], abs=1e-6)
    assert beam.schema.complete(None)["young"] == pytest.approx(1e-3 * AUTHORS)
    tip = np.array(list(beam.markers["tip"].values()))
    assert list(beam.markers["tip"]) == list(LAYOUT.tip)
    assert tip[:, 1] == pytest.approx(SIZE[2])
    # let go, it first falls about twice as deep as it hangs: the formula of a slender beam has 7 mm
    motion = beam.solve(PointCloud(tip.astype(np.float32)), {"viscous": 10.0})
    hangs = float((motion.vertices(0.0) - motion.vertices(1.99))[:, 2].mean())
    slender = 1070.0 * 9.80665 * SIZE[0] * SIZE[1] * SIZE[2] ** 4 / (8.0 * AUTHORS * SIZE[1] * SIZE[0] ** 3 / 12.0)
    assert hangs == pytest.approx(slender, rel=0.15)


def test_a_command_without_anything_to_do(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.argv", ["beam"])
    with pytest.raises(SystemExit):
        main()
    assert "expected a recording, or --model" in capsys.readouterr().err
