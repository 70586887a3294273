import os
from pathlib import Path

import numpy as np
import pytest
import torch
from authors import Authors

from odeform.cli import main
from odeform.errors import InputError
from odeform.models.authors.file import read_authors_checkpoint
from odeform.models.registry import open_checkpoint


class Malicious:
    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, ("opened-by-a-pickle",)


def test_reads_what_the_file_says(tmp_path: Path) -> None:
    checkpoint = open_checkpoint(Authors("pemlp", 1).save(tmp_path / "a.pth"))
    assert checkpoint.model == "released"
    assert checkpoint.config == {"encoder": "pemlp", "first_frame": 40, "frames": 20}
    assert checkpoint.schema.scene == "released-mass-elastic"
    assert [p.name for p in checkpoint.schema.parameters] == ["mass", "bending", "initial_offset"]
    assert (checkpoint.schema.window.start, checkpoint.schema.window.stop) == (2.0, 2.95)
    assert checkpoint.provenance["epoch"] == 3
    assert checkpoint.provenance["args"]["experiment"] == "mass_elastic"
    assert len(checkpoint.sha256) == 64


def test_frames_have_defaults(tmp_path: Path) -> None:
    window = read_authors_checkpoint(Authors("pointnet", 3).save(tmp_path / "a.pth", args={})).schema.window
    assert (window.start, window.stop, window.rate) == (0.0, 0.9, 10.0)


def test_broken_files_are_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    authors = Authors("mlp", 1)
    whole = authors.save(tmp_path / "whole.pth").read_bytes()
    (tmp_path / "cut.pth").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "text.pth").write_text("no checkpoint")
    (tmp_path / "empty.pth").write_bytes(b"")
    authors.save(tmp_path / "evil.pth", epoch=Malicious())
    torch.save([1, 2], tmp_path / "list.pth")
    authors.save(tmp_path / "half.pth", model2_state_dict=None)
    lacking = dict(authors.local.state_dict())
    lacking.pop("ode_func.mlp_net.4.bias")
    authors.save(tmp_path / "lacking.pth", model2_state_dict=lacking)
    nan = {name: value * float("nan") for name, value in authors.whole.state_dict().items()}
    authors.save(tmp_path / "nan.pth", model1_state_dict=nan)
    authors.save(tmp_path / "other.pth", model1_state_dict=Authors("mlp", 3).whole.state_dict())
    authors.save(tmp_path / "args.pth", args={"sequence_length": 1})
    for name in ("cut", "text", "empty", "evil", "list", "half", "lacking", "nan", "other", "args", "missing"):
        assert main(["info", f"{name}.pth"]) == 2
        said = capsys.readouterr().err.strip()
        assert f"{name}.pth" in said
        assert "\n" not in said
    assert not (tmp_path / "opened-by-a-pickle").exists()


def test_layers_that_do_not_follow_each_other_are_refused(tmp_path: Path) -> None:
    authors = Authors("pointnet_bn", 3)
    state = dict(authors.local.state_dict())
    state["encoder.conv2.weight"] = torch.zeros(128, 63, 1)
    with pytest.raises(InputError, match="sizes: 64 outputs into 63 inputs"):
        read_authors_checkpoint(authors.save(tmp_path / "a.pth", model2_state_dict=state))
    state = dict(authors.local.state_dict())
    state["encoder.bn2.running_var"] = -torch.ones(128)
    with pytest.raises(InputError, match="variance"):
        read_authors_checkpoint(authors.save(tmp_path / "b.pth", model2_state_dict=state))


def test_arrays_are_those_of_the_file(tmp_path: Path) -> None:
    authors = Authors("mlp", 3)
    arrays = read_authors_checkpoint(authors.save(tmp_path / "a.pth")).arrays
    wanted = {f"global.{k}": v for k, v in authors.whole.state_dict().items()}
    wanted |= {f"local.{k}": v for k, v in authors.local.state_dict().items()}
    assert set(arrays) - {"rest.points", "rest.faces"} == set(wanted)
    assert all(np.array_equal(arrays[name], value.numpy()) for name, value in wanted.items())
