"""Pictures and films as files: their pixels, their timing, and what is said in them."""

import io

import numpy as np
import pytest
from PIL import Image

from odeform.formats.picture_files import DESCRIPTION, FFMPEG, mp4_bytes, png_bytes, webp_bytes

NOTES = ("mass = 7 kg is outside the trained range", "t = 2 s is extrapolated")
SAID = "mass = 7 kg is outside the trained range. t = 2 s is extrapolated"


def _plain(red: int) -> np.ndarray:
    return np.full((20, 30, 3), (red, 40, 90), np.uint8)


def test_a_picture_is_lossless_and_says_what_is_outside() -> None:
    picture = Image.open(io.BytesIO(png_bytes(_plain(200), NOTES)))
    assert np.array_equal(np.asarray(picture), _plain(200))
    assert picture.info["Description"] == SAID
    assert "Description" not in Image.open(io.BytesIO(png_bytes(_plain(200), ()))).info


def test_a_film_has_its_frames_and_duration_and_says_what_is_outside() -> None:
    film = Image.open(io.BytesIO(webp_bytes([_plain(10), _plain(120), _plain(240)], 0.04, NOTES)))
    assert film.n_frames == 3  # pyright: ignore[reportAttributeAccessIssue]
    assert film.getexif()[DESCRIPTION] == SAID
    for frame, red in enumerate((10, 120, 240)):
        film.seek(frame)
        shown = np.asarray(film.convert("RGB")).astype(int)  # the duration is known once the frame is decoded
        assert np.abs(shown - _plain(red)).max() < 12
        assert film.info["duration"] == 40


@pytest.mark.skipif(FFMPEG is None, reason="needs ffmpeg on the PATH")
def test_a_film_for_slides_is_an_mp4_that_says_what_is_outside() -> None:
    film = mp4_bytes([_plain(10)[:19], _plain(240)[:19]], 0.04, NOTES)
    assert film[4:8] == b"ftyp"
    assert SAID.encode() in film
