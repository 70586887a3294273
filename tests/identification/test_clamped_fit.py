"""Stiffness and damping from markers: what was put in is found, through gaps, other markers and other axes."""

import io
from pathlib import Path

import c3d
import numpy as np
import pytest

from odeform.errors import InputError
from odeform.geometry.rigid import rotation_from_vector
from odeform.geometry.solids.block import block
from odeform.identification.clamped import MarkedBody, fit_swing, frequency_of, marked_body, static_young
from odeform.identification.release import MarkerLayout, Release, read_markers, released
from odeform.mechanics.clamped import GRAVITY, ClampedBody, held_by_face
from odeform.mechanics.quadratic import Stiffness, quadratic_mesh
from odeform.mechanics.swinging import Loss

YOUNG, GUESS, VISCOUS = 3e5, 2.4e5, 3e-3
LAYOUT = MarkerLayout(
    tip={"Tip 1": (0.035, 0.015, 0.1), "Tip 2": (0.02, 0.035, 0.1)},
    base={"Base 1": (0.0, 0.04, 0.006), "Base 2": (0.03, -0.01, 0.006)},
)
STILL, FRAMES, RATE = 30, 260, 100.0


def beam(young: float = GUESS) -> ClampedBody:
    mesh = quadratic_mesh(*block(np.zeros(3), np.array([0.03, 0.03, 0.1]), (1, 1, 4)))
    held = held_by_face(mesh, 2, low=True)
    return ClampedBody(Stiffness(mesh, young, 0.49), 1070.0, held, np.array([-GRAVITY, 0.0, 0.0]))


def measured(marked: MarkedBody) -> np.ndarray:
    """(T, 4, 3) m in axes of the body: held, let go, at rest."""
    places = np.array([*LAYOUT.tip.values(), *LAYOUT.base.values()])
    swing = marked.times_as_stiff(YOUNG).release(FRAMES / RATE, 1e-3, Loss(viscous=VISCOUS))
    points = np.tile(places, (STILL + FRAMES, 1, 1))
    points[STILL:, :2] += marked.seen(swing, np.arange(FRAMES) / RATE)
    return points


def marked_beam() -> MarkedBody:
    still = np.zeros((1, 2, 3))
    places = np.array(list(LAYOUT.tip.values()))
    release = Release(np.zeros(1), still, places, np.array([-1.0, 0.0, 0.0]), 0.0, 0.0, 0.0)
    return marked_body(beam(), release)


def write_c3d(path: Path, points: np.ndarray, labels: list[str], unseen: np.ndarray) -> None:
    writer = c3d.Writer(point_rate=RATE, analog_rate=0)
    for frame, lost in zip(1e3 * points, unseen, strict=True):
        residual = np.where(lost, -1.0, 0.0)
        writer.add_frames([(np.column_stack([frame, residual, np.zeros(len(frame))]), np.zeros((0, 1)))])
    writer.set_point_labels(labels)
    writer.get("POINT").set_str("UNITS", "", "mm", 2)
    file = io.BytesIO()
    writer.write(file)
    path.write_bytes(file.getvalue())


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """In other axes, with a marker more, labels written another way, and gaps while it swings."""
    points = measured(marked_beam())
    turn = rotation_from_vector(np.array([0.0, 0.5 * np.pi, 0.0])) @ rotation_from_vector(np.array([0.0, 0.02, 0.03]))
    points = np.concatenate([points[:, :2], np.ones((len(points), 1, 3)), points[:, 2:]], axis=1) @ turn.T + 0.2
    unseen = np.zeros(points.shape[:2], dtype=bool)
    unseen[50:53, 0] = unseen[60:64, 1] = True
    path = tmp_path_factory.mktemp("capture") / "beam.c3d"
    write_c3d(path, points, ["TIP_1", "tip-2", "wand", "Base 1", "Base 2"], unseen)
    return path


def test_what_was_put_in_is_found(capture: Path) -> None:
    markers = read_markers(capture)
    assert np.isnan(markers.points[51, 0]).all()
    release = released(markers, LAYOUT)
    assert release.misfit < 1e-4
    assert release.gravity @ [-1.0, 0.0, 0.0] > 0.998
    assert static_young(beam(), release) == pytest.approx(YOUNG, rel=0.01)
    fitted = fit_swing(marked_beam(), release, "viscous")
    assert fitted.young == pytest.approx(YOUNG, rel=0.01)
    assert fitted.loss.viscous == pytest.approx(VISCOUS, rel=0.05)
    assert fitted.rms(rest=True) < 1e-4
    depth = np.nanmean(fitted.predicted @ release.gravity, axis=1)
    natural = np.sqrt(beam(YOUNG).modes(1)[0][0]) / (2.0 * np.pi)
    assert frequency_of(fitted.times, depth) == pytest.approx(natural, rel=0.04)


def test_what_comes_later_is_not_looked_at(capture: Path) -> None:
    release, marked = released(read_markers(capture), LAYOUT), marked_beam()
    before = fit_swing(marked, release, "viscous").young
    release.displacements[release.times > 1.0] *= 1.05
    assert fit_swing(marked, release, "viscous").young == pytest.approx(before, rel=1e-3)


def test_a_frequency_is_that_of_a_decaying_swing() -> None:
    times = np.arange(0.0, 2.0, 0.01)
    assert frequency_of(times, 5.0 + np.exp(-2.0 * times) * np.sin(2 * np.pi * 4.3 * times)) == pytest.approx(
        4.3, rel=1e-2
    )


def test_recordings_that_do_not_fit_are_refused(capture: Path, tmp_path: Path) -> None:
    markers = read_markers(capture)
    with pytest.raises(InputError, match="Tip 9 missing"):
        released(markers, MarkerLayout({"Tip 9": (0.0, 0.0, 0.0)}, LAYOUT.base))
    with pytest.raises(InputError, match="mixed up"):
        released(markers, MarkerLayout({"Tip 1": (0.3, 0.0, 0.0), "Tip 2": (0.0, 0.3, 0.0)}, LAYOUT.base))
    markers.points[:] = markers.points[0]
    with pytest.raises(InputError, match="never moves"):
        released(markers, LAYOUT)
    path = tmp_path / "bad.npz"
    np.savez(path, times=np.zeros(3), positions=np.zeros((3, 1, 3)), labels=["a", "b"])
    with pytest.raises(InputError, match="expected positions"):
        read_markers(path)
