"""Frames per second of a figure with sliders, while it plays in a browser without a graphics card.

`python -m odeform_figures.speed.figure_frames figure.html` prints them. Needs Chromium, as the pictures of the docs do.
"""

import argparse
from pathlib import Path

from playwright.sync_api import sync_playwright

from odeform_figures.screenshots import CHROMIUM, FLAGS

__all__ = ["frames_per_second"]

SIZES = {"a laptop": (1280, 720), "half of it": (640, 480), "a phone": (390, 844)}
SETTLED, COUNTED = 40, 120  # frames that are drawn before the count begins, and counted
COUNT = """async ([settled, counted]) => {
  const reached = async (frames) => {
    while (window.figure.frames < frames) await new Promise((next) => requestAnimationFrame(next));
    return performance.now();
  };
  const first = window.figure.frames + settled, begin = await reached(first);
  return (1e3 * counted) / ((await reached(first + counted)) - begin);
}"""


def frames_per_second(file: Path, size: tuple[int, int]) -> float:
    """Returns how many frames of the figure in `file` are drawn in a second, in a window of `size` pixels."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        page = browser.new_page(viewport={"width": size[0], "height": size[1]})
        page.goto(file.resolve().as_uri())
        page.wait_for_function("window.figure && window.figure.playing")
        rate = page.evaluate(COUNT, [SETTLED, COUNTED])
        browser.close()
    return float(rate)


def main() -> None:
    """Prints frames per second for windows of several sizes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    file = parser.parse_args().file
    for name, size in SIZES.items():
        print(f"{name}, {size[0]} x {size[1]}: {frames_per_second(file, size):.0f} frames per second")


if __name__ == "__main__":
    main()
