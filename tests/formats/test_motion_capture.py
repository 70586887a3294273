"""C3D files: markers in metres, in the order of their labels; what is no position is left out, gaps are named."""

import io

import c3d
import numpy as np
import pytest

from odeform.errors import InputError
from odeform.formats.motion_capture import read_c3d

FRAMES, NAMES = 5, ["LANK", "LKNE", "LHIP"]


def capture(points: np.ndarray, names: list[str] = NAMES, units: str = "mm", angles: tuple[str, ...] = ()) -> bytes:
    """A file of (T, N, 4) points; the fourth number is the residual, negative where a marker is not seen."""
    writer = c3d.Writer(point_rate=100, analog_rate=0)
    for frame in points:
        writer.add_frames([(np.column_stack([frame, np.zeros(len(frame))]), np.zeros((0, 1)))])
    writer.set_point_labels(names)
    group = writer.get("POINT")
    group.set_str("UNITS", "", units, len(units))
    if angles:
        width = max(map(len, angles))
        group.add_str("ANGLES", "", "".join(name.ljust(width) for name in angles), width, len(angles))
    file = io.BytesIO()
    writer.write(file)
    return file.getvalue()


def moving() -> np.ndarray:
    points = np.zeros((FRAMES, 3, 4))
    points[:, :, :3] = 1000.0 * np.random.default_rng(0).normal(size=(FRAMES, 3, 3))
    return points


@pytest.mark.parametrize(("units", "metres"), [("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)])
def test_markers_are_in_metres(units: str, metres: float) -> None:
    read = read_c3d(capture(moving(), units=units), "a.c3d")
    assert read.labels == tuple(NAMES)
    assert np.allclose(read.points, metres * moving()[:, :, :3], rtol=1e-6)
    assert np.allclose(read.times, 0.01 * np.arange(FRAMES))
    assert read.notes == ()


def test_what_is_no_position_is_left_out() -> None:
    points = np.concatenate([moving(), moving(), moving()[:, :1]], axis=1)
    points[:, 3, 3] = -1.0
    names = [*NAMES, "*1", "HEAD", "CHIN", "KneeAngle"]
    read = read_c3d(capture(points, names, angles=("KneeAngle",)), "a.c3d")
    assert read.labels == (*NAMES, "HEAD", "CHIN")
    assert [note.split(":")[0] for note in read.notes] == [
        "1 computed points, such as angles and forces, are left out",
        "never seen and left out",
    ]


def test_gaps_are_kept_where_they_are_asked_for() -> None:
    points = moving()
    points[2:4, 1, 3] = -1.0
    read = read_c3d(capture(points), "a.c3d", gaps=True)
    assert read.labels == tuple(NAMES)
    assert np.isnan(read.points[2:4, 1]).all()
    assert np.isfinite(np.delete(read.points, 1, axis=1)).all()


def test_gaps_are_named() -> None:
    points = moving()
    points[2:4, 1, 3] = -1.0
    with pytest.raises(InputError, match=r"a.c3d: marker LKNE is not seen in 2 of 5 frames, first in frame 3: fill"):
        read_c3d(capture(points), "a.c3d")


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "expected a C3D file"),
        (b"PK" + bytes(600), "expected a C3D file"),
        (capture(moving(), units="furlong"), "expected units mm, .*got 'furlong'"),
        (capture(np.tile(moving(), (30, 1, 1)))[:-4000], "expected 150 frames, got .*truncated"),
        (bytes([2, 0x50]) + bytes(600), "damaged"),
    ],
)
def test_others_are_refused(data: bytes, message: str) -> None:
    with pytest.raises(InputError, match=f"a.c3d: .*{message}"):
        read_c3d(data, "a.c3d")
