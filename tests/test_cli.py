import argparse
import json
from importlib.metadata import EntryPoint, EntryPoints, entry_points, version
from pathlib import Path

import numpy as np
import pytest

from odeform.cli import main, run_guarded
from odeform.cli.entry import commands
from odeform.cli.evaluate import COLUMNS
from odeform.cli.evaluate import _table as scores_table
from odeform.dataset.index import Dataset
from odeform.dataset.store import open_dataset
from odeform.models.names import ALIASES
from odeform.models.registry import load
from odeform.training.train import _data_command
from tests.commands import run


def test_info(trained: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for model, path in trained.items():
        assert run("info", path) == 0
        result = json.loads(capsys.readouterr().out)
        assert result["model"] == ALIASES.get(model, model)
        assert result["schema"]["scene"] == "kick"
        assert result["sha256"] == load(path).checkpoint.sha256
        assert result["scores"]["rmse_pooled_mm"] > 0.0
        assert run("info", path, "--json", tmp_path / "info.json") == 0
        assert json.loads((tmp_path / "info.json").read_text()) == result
        assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("name", "family"), [("mass-elastic", "latent"), ("kick", "rolling"), ("contact-force", "modal")]
)
def test_info_says_what_a_model_is_made_of(name: str, family: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("info", name) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["model"] == family
    assert ("neural ODE" in said["made_of"]) == (family == "latent")
    assert ("no network" in said["made_of"]) == (family == "modal")


def test_info_tells_which_shapes_were_trained(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("info", "kick") == 0
    (body,) = json.loads(capsys.readouterr().out)["trained_shapes"]
    assert body["size_m"] == pytest.approx([0.2, 0.2, 0.2])
    assert body["tolerance_m"] == pytest.approx(0.004)


def test_stress_fails_with_its_checks(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    checks = {"good": {"holds": True, "figure": 0, "bound": 1}, "bad": {"holds": False, "figure": 2, "bound": 1}}
    inside = {"draws": 1, "stopped": 0, "stopped_in_window": 0, "first_stop_s": None}
    result = {"cases": 1, "non_finite_shown": 0, "by_status": {"ok": 1}, "inside": inside, "checks": checks}
    monkeypatch.setattr("odeform.stress.stress.stress", lambda *_, **__: result)
    assert run("stress", "kick") == 1
    said = capsys.readouterr()
    assert said.err.strip() == "failed: bad"
    assert "FAILS   bad" in said.out
    checks["bad"]["holds"] = True
    assert run("stress", "kick") == 0


def test_evaluate(
    trained: dict[str, Path], dataset: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report = tmp_path / "scores.json"
    arguments = ("evaluate", trained["odeform"], trained["nearest"], trained["pod-rbf"], "--data", dataset.root)
    assert run(*arguments, "--json", report) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["model", "latent", "nearest", "pod-rbf"]
    result = json.loads(report.read_text())
    names = ("odeform", "nearest", "pod-rbf")
    assert list(result["models"]) == [ALIASES.get(name, name) for name in names]
    for name, scores in zip(names, result["models"].values(), strict=True):
        said = load(trained[name]).checkpoint.scores
        assert scores["rmse_pooled_mm"] == pytest.approx(said["rmse_pooled_mm"], rel=1e-6)


def test_evaluate_on_another_scene_says_only_that(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("evaluate", "mass-elastic/nearest", "--data", "kick") != 0
    assert capsys.readouterr().err.splitlines() == ["error: nearest was trained on scene mass-elastic, not kick"]


def test_a_dash_in_the_scores_is_explained() -> None:
    scores = {**dict.fromkeys(COLUMNS, 1.0), "per_object": {}}
    assert scores_table({"odeform": scores}).splitlines()[-1].startswith("odeform")
    assert scores_table({"odeform": {**scores, COLUMNS[-1]: None}}).splitlines()[-1] == "-: not measured"


def test_train(dataset: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "new.safetensors"
    assert run("train", dataset.root, "--out", out, "--model", "nearest", "--window", "0:61", "--every", "2") == 0
    assert str(out) in capsys.readouterr().err
    assert load(out).schema.window.rate == pytest.approx(60.0)
    assert load(out).schema.window.stop == pytest.approx(0.5)


@pytest.mark.usefixtures("coarse")
def test_simulate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ("simulate", "kick", "--out", tmp_path / "new", "--count", 1, "--seed", 2, "--workers", 1, "--rate", 30)
    assert run(*arguments) == 0
    assert "1 sequence" in capsys.readouterr().out
    made = open_dataset(tmp_path / "new")
    sequence = made.read(made.entries[0])
    assert sequence.vertices.shape == (31, 66, 3)
    assert made.provenance["rate_hz"] == made.schema.window.rate == 30.0


@pytest.mark.usefixtures("coarse")
def test_simulate_other_ranges(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ("simulate", "kick", "--out", tmp_path, "--count", 1, "--workers", 1, "--rate", 30)
    assert run(*arguments, "--range", "force=160:200", "elevation=0:0.1") == 0
    made = open_dataset(tmp_path)
    ranges = {p.name: (p.low, p.high, p.default) for p in made.schema.parameters}
    assert (ranges["force"], ranges["elevation"]) == ((160.0, 200.0, 160.0), (0.0, 0.1, 0.1))
    assert made.schema.outside(made.entries[0].parameters) == ()
    assert made.provenance["ranges"] == {"force": [160.0, 200.0], "elevation": [0.0, 0.1]}
    assert _data_command(made.provenance).endswith("--range force=160.0:200.0 elevation=0.0:0.1")
    capsys.readouterr()
    assert run(*arguments) == 2
    assert "holds another data set" in capsys.readouterr().err


def test_pack(dataset: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "new" / "kick.odp"
    assert run("pack", dataset.root, "--out", out, "--tolerance", 0.1) == 0
    said = capsys.readouterr().out
    assert said.startswith(f"{out}: {out.stat().st_size / 1e6:.2f} MB, ")
    largest = float(said.split("error of a vertex at most ")[1].split(" mm")[0])
    errors = []
    packed = open_dataset(out)
    for one, two in zip(dataset.sequences("all"), packed.sequences("all"), strict=True):
        errors.append(1e3 * np.linalg.norm(one.vertices.astype(float) - two.vertices, axis=2).max())
    assert largest == pytest.approx(max(errors), abs=1e-3)
    assert 0.01 < largest <= 0.1


def test_a_packed_data_set_serves_as_its_folder(
    trained: dict[str, Path], dataset: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "kick.odp"
    assert run("pack", dataset.root, "--out", out) == 0
    scores = {}
    for data in (dataset.root, out):
        assert run("evaluate", trained["pod-rbf"], "--data", data, "--json", tmp_path / "scores.json") == 0
        scores[data] = json.loads((tmp_path / "scores.json").read_text())["models"]["pod-rbf"]
    for name, close in (("rmse_pooled_mm", 1e-3), ("off_grid_rmse_mm", 1e-3), ("deformation_relative", 2e-2)):
        assert scores[out][name] == pytest.approx(scores[dataset.root][name], rel=close)
    assert run("train", out, "--out", tmp_path / "a.safetensors", "--model", "nearest") == 0
    assert load(tmp_path / "a.safetensors").schema == load(trained["nearest"]).schema
    capsys.readouterr()


BAD = {
    "info: no such checkpoint": "info nothing.safetensors",
    "info: not a checkpoint": "info {text}",
    "info: a folder": "info {data}",
    "info: cannot write": "info {nearest} --json {text}/info.json",
    "evaluate: no such checkpoint": "evaluate nothing --data {data}",
    "evaluate: no data set": "evaluate {nearest} --data {empty}",
    "evaluate: window": "evaluate {nearest} --data {data} --window 5",
    "evaluate: window reversed": "evaluate {nearest} --data {data} --window 9:3",
    "predict: no such checkpoint": "predict nothing --out {empty}/a.npz",
    "predict: ending": "predict {nearest} --out {empty}/a.obj",
    "predict: one file for all frames": "predict {nearest} --out {empty}/a.ply",
    "predict: unknown parameter": "predict {nearest} --out {empty}/a.npz --set speed=3",
    "predict: no value": "predict {nearest} --out {empty}/a.npz --set mass",
    "predict: word": "predict {nearest} --out {empty}/a.npz --set mass=heavy",
    "predict: negative": "predict {nearest} --out {empty}/a.npz --set mass=-1",
    "predict: not finite": "predict {nearest} --out {empty}/a.npz --set force=nan",
    "predict: times": "predict {nearest} --out {empty}/a.npz --times 1:0:0.1",
    "predict: sweep of an unknown parameter": "predict {odeform} --out {empty}/a.html --sweep speed=1:2",
    "predict: sweep backwards": "predict {odeform} --out {empty}/a.html --sweep mass=1:0.5",
    "predict: sweep of words": "predict {odeform} --out {empty}/a.html --sweep mass=light:heavy",
    "predict: sweep of 4": "predict {odeform} --out a.html --sweep mass=1:2 bending=1:2 force=1:2 azimuth=0:1",
    "predict: sweep to another format": "predict {odeform} --out {empty}/a.npz --sweep mass=0.5:1",
    "predict: sweep into no folder": "predict {odeform} --out {empty}/none/a.html --sweep mass=0.5:1",
    "predict: sweep of what is set": "predict {odeform} --out {empty}/a.html --sweep mass=0.5:1 --set mass=0.6",
    "predict: quality": "predict {odeform} --out {empty}/a.npz --quality perfect",
    "predict: no such shape": "predict {nearest} --out {empty}/a.npz --geometry nothing.obj",
    "predict: no shape": "predict {nearest} --out {empty}/a.npz --geometry {text}",
    "train: no data set": "train {empty} --out {empty}/a.safetensors",
    "train: unknown model": "train {data} --out {empty}/a.safetensors --model oracle",
    "train: window": "train {data} --out {empty}/a.safetensors --window 0:b",
    "train: steps": "train {data} --out {empty}/a.safetensors --steps 0",
    "pack: no data set": "pack {empty} --out {empty}/a.odp",
    "pack: ending": "pack {data} --out {empty}/a.zip",
    "pack: no such file": "pack {empty}/a.odp --out {empty}/b.odp",
    "pack: not a data set": "pack {text} --out {empty}/a.odp",
    "evaluate: not a data set": "evaluate {nearest} --data {text}",
    "simulate: unknown scene": "simulate throw --out {empty}",
    "simulate: another data set": "simulate kick --out {data} --count 2",
    "simulate: count": "simulate kick --out {empty} --count 0",
    "simulate: workers": "simulate kick --out {empty} --workers 0",
    "simulate: rate": "simulate kick --out {empty} --rate nan",
    "simulate: no range": "simulate kick --out {empty} --range force",
    "simulate: half a range": "simulate kick --out {empty} --range force=10",
    "simulate: empty range": "simulate kick --out {empty} --range force=10:10",
    "simulate: range of an unknown parameter": "simulate kick --out {empty} --range speed=1:2",
    "simulate: range of a contact": "simulate contact-force --out {empty} --range force_x=1:2",
}


@pytest.mark.parametrize("fault", BAD)
def test_faults_in_one_line(
    trained: dict[str, Path], dataset: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str], fault: str
) -> None:
    (tmp_path / "text.txt").write_text("hello\n")
    (tmp_path / "empty").mkdir()
    places = {**trained, "data": dataset.root, "text": tmp_path / "text.txt", "empty": tmp_path / "empty"}
    assert run(*(word.format(**places) for word in BAD[fault].split())) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert len(captured.err.splitlines()) == 1
    assert captured.err.startswith("error: ")
    assert list((tmp_path / "empty").iterdir()) == []


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["--version"])
    assert end.value.code == 0
    assert capsys.readouterr().out == f"odeform {version('odeform')}\n"


@pytest.mark.parametrize("command", commands())
def test_every_argument_has_a_help_text(command: str) -> None:
    parser = argparse.ArgumentParser()
    commands()[command].add_options(parser)
    assert all(action.help for action in parser._actions)


@pytest.mark.parametrize("command", commands())
def test_help_lists_the_arguments(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main([command, "--help"])
    assert end.value.code == 0
    assert capsys.readouterr().out.startswith(f"usage: odeform {command} ")


def test_a_declared_command_is_listed_only_where_its_package_is_installed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A wheel declares commands of a clone."""
    found = entry_points(group="odeform.commands")
    absent = EntryPoints([EntryPoint(one.name, f"no_such_package.{one.name}", one.group) for one in found])
    monkeypatch.setattr("odeform.cli.declared.entry_points", lambda **which: absent.select(**which))
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "tables" not in capsys.readouterr().out
    assert main(["tables", "--keep", "a", "--out", "b"]) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert line.startswith("error: odeform tables: it makes figures of the documentation, and needs a clone")


@pytest.mark.parametrize("arguments", [[], ["fly"], ["predict"], ["predict", "a", "--out"], ["train", "a"]], ids=str)
def test_usage(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as error:
        main(arguments)
    assert error.value.code == 2
    assert "usage: odeform" in capsys.readouterr().err


def test_interrupted(capsys: pytest.CaptureFixture[str]) -> None:
    def work() -> None:
        raise KeyboardInterrupt

    assert run_guarded(work) == 130
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_a_folder_that_a_command_creates_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "new" / "info.json"
    assert main(["info", "kick", "--json", str(out)]) == 0
    assert f"note: created the folder {out.parent}" in capsys.readouterr().err
    assert main(["info", "kick", "--json", str(out)]) == 0
    assert "note" not in capsys.readouterr().err


def test_the_version_needs_no_command_and_help_describes_every_argument(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, said in ((["--version"], ["odeform "]), (["predict", "--help"], ["bundled", "units", "reference"])):
        with pytest.raises(SystemExit) as ended:
            main(arguments)
        assert ended.value.code == 0
        out = capsys.readouterr().out
        assert all(word in out for word in said)
