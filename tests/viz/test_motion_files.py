"""Whole motions as a Rerun recording and as a page: what was written is what was predicted."""

import base64
import io
import re
import struct
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import zstandard

import odeform
from odeform.cli import main
from odeform.formats.registry import motion_formats
from odeform.motion.base import Motion
from odeform_viz.motion_files import write_html, write_rrd
from odeform_viz.recording.reader import read_recording

TIMES = np.array([0.0, 0.1, 0.25, 0.3])


@pytest.fixture(scope="module")
def motion() -> Motion:
    return odeform.load("kick").solve(parameters={"mass": 0.6, "force": 180.0})


def _played(page: str) -> dict[str, Any]:
    """What the page plays: `durationSeconds`, and `messages` with their times."""
    data = re.search(r'__VISER_EMBED_DATA__="([^"]+)"', page)
    assert data is not None
    raw = base64.b64decode(data[1])
    body = zstandard.ZstdDecompressor().decompress(raw[8:], max_output_size=struct.unpack_from("<Q", raw)[0])
    size = struct.unpack_from("<Q", body)[0]
    return msgspec.msgpack.decode(body[8 : 8 + size])


def test_a_page_plays_the_motion_at_its_own_speed(motion: Motion) -> None:
    file = io.BytesIO()
    write_html(file, motion, TIMES, None)
    page = file.getvalue().decode()
    played = _played(page)
    assert played["durationSeconds"] == pytest.approx(0.3)
    moved = {time for time, message in played["messages"] if message.get("name", "").endswith("/body")}
    assert moved >= set(TIMES[1:])
    assert "force 180 N" in page
    assert "<title>ball, kicked · ODeform</title>" in page
    assert "0 to 0.3 s, lengths in metres" in page
    assert "force = 180 N is outside the trained range, 10 to 160 N" in page


def test_nothing_of_a_parameter_becomes_markup(motion: Motion, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("odeform_viz.motion_files.caveats", lambda *_: ("<script>alert(1)</script>",))
    file = io.BytesIO()
    write_html(file, motion, TIMES[:1], None)
    assert b"&lt;script&gt;alert(1)" in file.getvalue()
    assert b"<script>alert(1)" not in file.getvalue()


def test_a_recording_has_every_frame(motion: Motion, tmp_path: Path) -> None:
    path = tmp_path / "motion.rrd"
    with path.open("wb") as file:
        write_rrd(file, motion, TIMES, None)
    recording = read_recording(path)
    assert [request["time"] for _, request in sorted(recording.requests.items())] == pytest.approx(TIMES.tolist())
    assert all(request["parameters"]["force"] == 180.0 for request in recording.requests.values())


@pytest.mark.parametrize("suffix", [".rrd", ".html"])
def test_predict_writes_them(suffix: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert suffix in motion_formats()
    out = tmp_path / f"motion{suffix}"
    assert main(["predict", "mass-elastic", "--out", str(out), "--times", "0:0.3:0.1"]) == 0
    assert out.stat().st_size > 10_000
    assert main(["predict", "mass-elastic", "--out", str(out), "--times", "0:0.3:0.1"]) == 2
    assert "--force" in capfd.readouterr().err
