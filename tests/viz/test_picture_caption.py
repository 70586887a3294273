"""The strip below a picture: what it says, and that what is framed is in the middle."""

import numpy as np

from odeform_viz.picture_caption import captioned, cropped_to_view
from odeform_viz.rendering.framing import free_area
from odeform_viz.view import ColorScale

SCALE = ColorScale("error", "mm", 2.5, False)


def _picture(width: int, height: int) -> np.ndarray:
    return np.zeros((height, width, 3), np.uint8)


def test_what_is_framed_is_in_the_middle_of_the_picture() -> None:
    viewport = (1440, 900)
    left, top, right, bottom = free_area(viewport)
    picture = _picture(720, 450)  # half as large
    picture[round(0.25 * (top + bottom)), round(0.25 * (left + right))] = 255
    cropped = cropped_to_view(picture, viewport)
    found = np.argwhere(cropped[..., 0] == 255)[0]
    assert np.abs(found - 0.5 * np.array(cropped.shape[:2])).max() <= 1.0


def test_a_page_without_room_is_not_cropped_away() -> None:
    assert cropped_to_view(_picture(20, 20), (20, 20)).shape == (20, 20, 3)


def test_the_strip_has_words_and_the_colours_of_values() -> None:
    picture = _picture(720, 100)
    plain, scaled = captioned(picture, "ball, kicked", 0.25, None), captioned(picture, "ball, kicked", 0.25, SCALE)
    assert np.array_equal(scaled[:100], picture)
    strip, bare = scaled[100:].astype(int), plain[100:].astype(int)
    assert bare.min() < 100 < bare.max()
    assert not np.array_equal(captioned(picture, "ball, kicked", 0.5, None), plain)
    colourful = np.ptp(strip, axis=2) > 40
    assert colourful.any(axis=0).sum() > 0.3 * 720
    assert not (np.ptp(bare, axis=2) > 40).any()


def test_a_long_caption_leaves_the_bar_alone() -> None:
    short, long = (captioned(_picture(400, 40), text, 0.0, SCALE)[40:] for text in ("a", "very long words " * 20))
    assert np.array_equal(short[:, 260:], long[:, 260:])
