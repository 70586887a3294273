"""Films of motions, drawn without a browser."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import odeform
from odeform.formats.motion_film import MOST, SHORTEST, STAY, _views
from odeform.formats.picture_files import DESCRIPTION


def _film(path: Path) -> tuple[list[np.ndarray], list[float], str]:
    film, frames, seconds = Image.open(path), [], []
    for frame in range(film.n_frames):  # pyright: ignore[reportAttributeAccessIssue]
        film.seek(frame)
        frames.append(np.asarray(film.convert("RGB")).astype(int))
        seconds.append(1e-3 * film.info["duration"])
    return frames, seconds, film.getexif().get(DESCRIPTION, "")


def test_a_film_shows_every_time_and_no_faster_than_can_be_seen(tmp_path: Path) -> None:
    motion = odeform.load("kick").solve(parameters={"mass": 0.6})
    odeform.write_motion(motion, np.array([0.0, 0.01, 0.11]), tmp_path / "kick.webp")
    frames, seconds, said = _film(tmp_path / "kick.webp")
    assert seconds == pytest.approx([SHORTEST, 0.1, STAY])
    assert all(np.abs(one - other).max() > 50 for one, other in pairwise(frames))
    assert said == ""


def test_a_film_says_what_is_outside_of_what_was_trained(tmp_path: Path) -> None:
    motion = odeform.load("kick").solve(parameters={"mass": 2.0})
    odeform.write_motion(motion, np.array([0.0, 0.1]), tmp_path / "kick.webp")
    frames, _, said = _film(tmp_path / "kick.webp")
    assert "mass = 2 kg is outside the trained range" in said
    red = frames[0][..., 0] - frames[0][..., 1]
    assert (red[:40] > 60).sum() > 100
    assert (red[60:] < 60).all()


def test_too_many_frames_are_refused_and_nothing_is_written(tmp_path: Path) -> None:
    motion = odeform.load("kick").solve()
    with pytest.raises(odeform.InputError, match=f"at most {MOST} frames, got {MOST + 1}"):
        odeform.write_motion(motion, np.linspace(0.0, 1.0, MOST + 1), tmp_path / "kick.webp")
    assert not list(tmp_path.iterdir())


def test_the_view_goes_along_with_a_body_that_goes_far() -> None:
    box = np.array([[-0.1, -0.1, 0.0], [0.1, 0.1, 0.2]])
    stays = _views(np.array([box, box + np.array([0.2, 0.0, 0.1])]))
    assert np.array_equal(stays[0].target, stays[1].target)
    goes = _views(np.array([box, box + np.array([3.0, 0.0, 0.1])]))
    np.testing.assert_allclose(goes[1].target - goes[0].target, [3.0, 0.0, 0.0])
    assert goes[0].height == goes[1].height < 2.0


def test_the_whole_motion_lies_in_the_picture() -> None:
    low = np.array([[0.0, 0.0, 0.0], [0.3, -0.2, 0.4]])
    boxes = np.stack([low, low + 0.3], axis=1)
    corners = np.array([[boxes[i, j, 0], boxes[i, k, 1], boxes[i, m, 2]] for i, j, k, m in np.ndindex(2, 2, 2, 2)])
    view = _views(boxes)[0]
    seen = view.project(corners)[:, :2] / (2.0 * np.array(view.size))
    assert (seen > 0.0).all()
    assert (seen < 1.0).all()
