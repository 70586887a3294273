"""Motions of one's own, from `.npz` files."""

import io
import json
from typing import Any

import numpy as np
import pytest

import odeform
from odeform.dataset.captured import read_captured
from odeform.errors import InputError
from odeform.motion.recorded import RecordedMotion
from odeform.schema import Schema
from odeform.types import Mesh, MotionSequence

FILE = "captured.npz"


@pytest.fixture(scope="module")
def sequence() -> MotionSequence:
    return next(odeform.open_dataset("mass-elastic").sequences("test"))


@pytest.fixture(scope="module")
def schema() -> Schema:
    return odeform.open_dataset("mass-elastic").schema


def pack(**arrays: Any) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def test_times_and_vertices_suffice(sequence: MotionSequence, schema: Schema) -> None:
    data = pack(times=sequence.times + 3.0, vertices=sequence.vertices)
    read = read_captured(data, FILE, schema, sequence.rest)
    np.testing.assert_allclose(read.times, sequence.times, atol=1e-12)
    assert np.array_equal(read.vertices, sequence.vertices)
    assert np.array_equal(read.faces, sequence.faces)
    assert read.weights.sum() == pytest.approx(1.0)
    assert read.parameters == {}
    assert RecordedMotion(schema, read).unknown == ("mass", "bending")


def test_what_is_known_is_taken(sequence: MotionSequence, schema: Schema) -> None:
    known = {"mass": 0.7, "elsewhere": 1.0}
    data = pack(
        times=sequence.times, vertices=sequence.vertices, faces=sequence.faces, parameters=np.array(json.dumps(known))
    )
    read = read_captured(data, FILE, schema, Mesh(np.zeros((3, 3)), np.zeros((0, 3), int)))
    assert read.parameters == {"mass": 0.7}
    assert RecordedMotion(schema, read).unknown == ("bending",)


def test_uneven_frames_are_resampled(sequence: MotionSequence, schema: Schema) -> None:
    kept = np.delete(np.arange(len(sequence.times)), [3, 4, 50])
    data = pack(times=sequence.times[kept], vertices=sequence.vertices[kept])
    read = read_captured(data, FILE, schema, sequence.rest)
    np.testing.assert_allclose(np.diff(read.times), read.times[1], rtol=1e-9)
    true = RecordedMotion(schema, sequence).vertices(read.times)
    assert np.abs(read.vertices - true).max() < 2e-3


def test_a_predicted_motion_can_be_opened(tmp_path: Any, schema: Schema) -> None:
    predictor = odeform.load("mass-elastic")
    motion, times = predictor.solve(parameters={"mass": 0.8}), np.linspace(0.0, 0.5, 31)
    odeform.write_motion(motion, times, tmp_path / FILE)
    read = read_captured((tmp_path / FILE).read_bytes(), FILE, schema, predictor.rest)
    np.testing.assert_allclose(read.vertices, motion.vertices(times), atol=1e-6)
    assert read.parameters == pytest.approx(dict(motion.parameters))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"vertices": np.zeros((3, 5, 3), np.float32), "times": np.arange(3.0)}, "expected faces"),
        ({"times": np.zeros(151)}, "one for each frame"),
        ({"vertices": None}, r"expected an array vertices \(T, N, 3\), got times"),
        ({"parameters": np.array("[1]")}, "by name"),
        ({"parameters": np.array('{"mass": "heavy"}')}, "mass"),
        ({"faces": np.array([[0, 1, 9999]])}, "faces refer"),
        ({"weights": np.ones(3)}, "weights"),
    ],
)
def test_others_are_refused(sequence: MotionSequence, schema: Schema, change: dict[str, Any], message: str) -> None:
    arrays = {"times": sequence.times, "vertices": sequence.vertices, **change}
    data = pack(**{name: array for name, array in arrays.items() if array is not None})
    with pytest.raises(InputError, match=message):
        read_captured(data, FILE, schema, sequence.rest)


def test_what_is_no_archive_is_refused(schema: Schema, sequence: MotionSequence) -> None:
    with pytest.raises(InputError, match=f"{FILE}: damaged"):
        read_captured(b"PK\x03\x04 nothing", FILE, schema, sequence.rest)


def test_time_runs_forward(schema: Schema, sequence: MotionSequence) -> None:
    data = pack(times=-sequence.times, vertices=sequence.vertices)
    with pytest.raises(InputError, match="times that increase"):
        read_captured(data, FILE, schema, sequence.rest)


def test_frames_are_apart_in_time(schema: Schema, sequence: MotionSequence) -> None:
    times = sequence.times.copy()
    times[-1] = 1e12
    with pytest.raises(InputError, match="times that increase by at least"):
        read_captured(pack(times=times, vertices=sequence.vertices), FILE, schema, sequence.rest)
