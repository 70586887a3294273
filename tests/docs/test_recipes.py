"""A family of one's own, as `docs/recipes.md` shows it: one file, trained and opened by the commands of the page."""

import json
import os
from pathlib import Path

import pytest
from blocks import ROOT, blocks_of

import odeform
from odeform.cli import main
from odeform.dataset.folder import save_sequence, write_index
from odeform.models import plugins

FILE = next(b for b in blocks_of(ROOT / "docs" / "recipes.md") if b.title == "my_family.py")
MOST = 120  # lines


def test_a_family_of_ones_own_is_one_short_file() -> None:
    assert len(FILE.code.splitlines()) <= MOST


@pytest.fixture
def plugin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file, in a program that does not know its model yet."""
    monkeypatch.setenv(plugins.FILES, "")
    path = tmp_path / "my_family.py"
    path.write_text(FILE.code.replace("second-order", "my-own"))
    return path


def few_motions(folder: Path) -> Path:
    """Some motions of the bundled data set, as a folder."""
    dataset = odeform.open_dataset("mass-elastic")
    entries = dataset.select("train")[:8] + dataset.select("val")[:2] + dataset.select("test")[:2]
    kept = []
    for entry in entries:
        sequence = dataset.read(entry).until(0.3)
        kept.append(type(entry)(entry.name, entry.split, entry.parameters, save_sequence(folder, entry.name, sequence)))
    write_index(type(dataset)(folder, dataset.schema, tuple(kept), dataset.read, dataset.fixed, dataset.provenance))
    return folder


@pytest.mark.slow
def test_it_is_trained_evaluated_and_known_by_its_file_alone(
    plugin: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, out, result = few_motions(tmp_path / "data"), tmp_path / "mine.safetensors", tmp_path / "info.json"
    train = ["train", str(data), "--model", "my-own", "--steps", "2", "--window", "0:21", "--every", "4"]
    assert main([*train, "--out", str(out)]) == 2
    assert "unknown model 'my-own'" in capsys.readouterr().err
    assert main([*train, "--out", str(out), "--plugin", str(plugin)]) == 0
    assert str(plugin) in os.environ[plugins.FILES]  # for the processes that a program starts
    assert main(["info", str(out), "--json", str(result), "--plugin", str(plugin)]) == 0
    assert json.loads(result.read_text())["model"] == "my-own"
    assert odeform.load(out).solve(quality="draft").vertices(0.1).shape[1] == 3


def test_a_plugin_is_a_python_file_that_is_there(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "mass-elastic", "--plugin", "none.py"]) == 2
    assert "--plugin none.py: expected a Python file" in capsys.readouterr().err


def test_errors_of_a_plugin_are_its_own(tmp_path: Path) -> None:
    path = tmp_path / "broken_family.py"
    path.write_text("import nothing_of_this_name\n")
    with pytest.raises(ModuleNotFoundError, match="nothing_of_this_name"):
        main(["info", "mass-elastic", "--plugin", str(path)])
