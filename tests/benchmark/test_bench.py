import json
from pathlib import Path

import pytest

from odeform.benchmark import batch, bench, comparisons, precision, roofline
from odeform.cli import main
from odeform.dataset.index import Dataset
from odeform.models.base import Predictor

pytestmark = pytest.mark.slow

full_ladder, full_load = precision.ladder, comparisons.load


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch, trained: dict[str, Path]) -> None:
    """The whole benchmark on tiny problems."""
    for module, name, value in (
        (precision, "REPEATS", 1),
        (precision, "SEQUENCES", 1),
        (precision, "ladder", lambda frame: full_ladder(frame)[::6]),
        (roofline, "SIDE", 64),
        (roofline, "BYTES", 1 << 16),
        (roofline, "POINTS", 400),
        (bench, "SIZES", (100, 200)),
        (comparisons, "PER_POINT", {50: 1, 100: 1}),
        (comparisons, "POINTS", 100),
        (comparisons, "SEQUENCES", 1),
        (comparisons, "simulator", lambda *_: {"skipped": "no time"}),
        (comparisons, "bundled_checkpoints", lambda: {f"kick/{m}": p for m, p in trained.items() if m != "nearest"}),
        (comparisons, "load", lambda name: full_load(trained[name.split("/")[1]])),
        (bench, "POINTS", 100),
        (batch, "MOTIONS", 3),
        (batch, "LOOP", 2),
        (bench, "SPLATS", 1000),
    ):
        monkeypatch.setattr(module, name, value)


@pytest.mark.usefixtures("small")
def test_bench(
    trained: dict[str, Path],
    dataset: Dataset,
    predictors: dict[str, Predictor],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "bench.json"
    arguments = ["bench", str(trained["odeform"]), "--data", str(dataset.root), "--json", str(out)]
    assert main(arguments) == 0
    text, result = capsys.readouterr().out, json.loads(out.read_text())
    columns = {"evaluations", "ms_p50", "ms_p95", "solver_error_mm", "model_error_mm", "solver", "dtype", "at"}
    for row in result["work_precision"] + list(result["qualities"].values()):
        assert columns < set(row)
        assert ("step" in row) != ("tolerance" in row)
    assert {(row["at"], row["dtype"]) for row in result["work_precision"]} == {
        (point, dtype) for point in ("default", "corner") for dtype in ("float32", "float64")
    }
    assert list(result["qualities"]) == ["draft", "balanced", "reference"]
    assert len(result["frontier"]) == len(predictors["odeform"].frontier)
    assert {"parameter_change_ms", "scrub_ms", "splats_1k_ms", "encode_ms", "solve_ms", "basis_ms"} < set(
        result["latency"]
    )
    assert [row["points"] for row in result["scaling"]] == [100, 200]
    assert set(result["peers"]) == {
        "per-point latent ODE, 50 points",
        "per-point latent ODE, 100 points",
        "this model",
        "pod-rbf",
        "torchdiffeq, same field",
        "SciPy, same field, equal error",
        "mujoco, equal error",
    }
    assert result["peers"]["this model"]["error_mm"] > 0.0
    assert {"gemm_gflops", "memory_gb_s", "decode_share_of_limit"} < set(result["limits"])
    assert result["batch"]["motions"] == 3
    assert min(result["batch"][key] for key in ("ms_a_motion", "loop_ms_a_motion")) > 0.0
    assert "mujoco, equal error: skipped, no time" in text
    for word in ("bosh3", "frontier", "pod-rbf", "decode_share_of_limit"):
        assert word in text


@pytest.mark.usefixtures("small")
def test_models_that_are_not_timed_are_named(
    monkeypatch: pytest.MonkeyPatch, predictors: dict[str, Predictor], point_models: dict[str, Path]
) -> None:
    paths = {f"kick/{model}": point_models[model] for model in ("occupancy-flow", "odeform-per-point")}
    monkeypatch.setattr(comparisons, "bundled_checkpoints", lambda: paths)
    monkeypatch.setattr(comparisons, "load", lambda name: full_load(paths[name]))
    rows = comparisons.comparisons(predictors["pod-rbf"], None, [])
    assert "given frames" in rows["occupancy-flow"]["skipped"]
    assert "takes minutes" in rows["odeform-per-point"]["skipped"]


@pytest.mark.usefixtures("small")
def test_a_model_without_a_solver_is_measured_too(
    trained: dict[str, Path], dataset: Dataset, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bench", str(trained["pod-rbf"]), "--data", str(dataset.root)]) == 0
    text = capsys.readouterr().out
    assert "pod-rbf of kick" in text
    assert "frontier" not in text
