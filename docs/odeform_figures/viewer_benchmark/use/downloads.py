"""Downloads: motions in all formats, screenshots and films."""

from collections.abc import Iterator
from contextlib import contextmanager

from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_figures.viewer_benchmark.visitors import Visitors

__all__ = ["export", "take_pictures"]

AT_ONCE = 3  # formats of one visit
DRAWING = 0.2  # s for a picture
OUTSIDE = "outside the trained range"  # a note, as sliders go beyond it
SIGNATURES = {"screenshot.png": b"\x89PNG", "motion.webp": b"RIFF", ".glb": b"glTF", ".npz": b"PK", ".rrd": b"RRF2"}


def export(visitors: Visitors) -> None:
    """Download some formats; another browser drags a slider meanwhile."""
    client = visitors.first
    formats = client.controls["format"].props["options"]
    visitors.allow(OUTSIDE)
    client.downloads.clear()  # an earlier file would be taken for one of these
    for label in visitors.rng.permutation(formats)[:AT_ONCE]:
        client.set("format", str(label))
        client.click("Download")
        visitors.drag(visitors.second, 5)
        _expect_download(visitors, str(label).rpartition("(")[2].rstrip(")"))


def take_pictures(visitors: Visitors) -> None:
    """A screenshot, a film that is cancelled, and one whose browser closes."""
    visitors.first.downloads.clear()  # an earlier screenshot would be taken for this one
    visitors.first.click("Screenshot (.png)")
    _expect_download(visitors, "screenshot.png")
    with _slowly(visitors.first) as client:
        client.click("Film (.webp)")
        visitors.expect_control("Cancel the film")
        visitors.second.click("Cancel the film")
        visitors.expect_control("Film (.webp)")
    with visitors.another() as client, _slowly(client):
        client.click("Film (.webp)")
        visitors.expect_control("Cancel the film")
    visitors.expect_refusal("")  # in the words of viser
    visitors.expect_control("Film (.webp)")


@contextmanager
def _slowly(client: LoopbackClient) -> Iterator[LoopbackClient]:
    """The client takes its time for each picture, so that a film is still being made when it is cancelled."""
    client.drawing_s = DRAWING
    try:
        yield client
    finally:
        client.drawing_s = 0.0


def _expect_download(visitors: Visitors, suffix: str) -> None:
    client = visitors.first
    visitors.expect(f"a download of {suffix}", lambda: bool(client.downloaded(suffix)))
    content = client.downloaded(suffix) or b""
    assert content.startswith(SIGNATURES.get(suffix, b"")), f"{suffix} begins with {content[:8]}"
    client.downloads.clear()
