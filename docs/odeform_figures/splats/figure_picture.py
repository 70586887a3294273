"""A figure of splats from two sides: `python -m odeform_figures.splats.figure_picture FIGURE.html --out PICTURE.webp`.

Needs playwright and Chromium, as `odeform_figures.opened_page` does.
"""

import argparse
import io
import sys
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

from odeform_figures.opened_page import CHROMIUM, FLAGS

__all__ = ["main", "views"]

SIZE = (620, 720)  # px, with the sliders, which are cut off
NEAR = 3.0  # sizes of the body, from its middle to the camera
MOMENT = 0.1  # s
AROUND = (0.35, -1.2)  # radians from where the camera is at first
DEADLINE = 60_000  # ms


def views(file: Path) -> Image.Image:
    """Takes both, side by side. `RuntimeError` if the console says anything."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        page, said = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]}), []
        page.set_default_timeout(DEADLINE)
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.goto(f"{file.resolve().as_uri()}#paused")
        page.wait_for_function("window.figure && window.figure.frames > 0")
        first = page.evaluate("window.figure.camera.azimuth")
        pictures = [_view(page, first + turn) for turn in AROUND]
        browser.close()
    if said:
        raise RuntimeError(f"the console says: {said[0]}")
    out = Image.new("RGB", (sum(picture.width for picture in pictures), pictures[0].height))
    for index, picture in enumerate(pictures):
        out.paste(picture, (index * picture.width, 0))
    return out


def _view(page: Page, azimuth: float) -> Image.Image:
    page.evaluate(
        """([azimuth, near, time]) => {
          const { figure } = window, size = Math.max(...[0, 1, 2].map((d) => {
            const along = figure.columns[0].points.filter((_, i) => i % 3 === d);
            return Math.max(...along) - Math.min(...along);
          }));
          Object.assign(figure.camera, { azimuth, elevation: 0.45, distance: near * size });
          Object.assign(figure, { time, shown: true });
        }""",
        [azimuth, NEAR, MOMENT],
    )
    page.wait_for_function("!window.figure.shown")
    return Image.open(io.BytesIO(page.locator("#canvas").screenshot())).convert("RGB")


def main() -> None:
    """Take the picture from the command line."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.splats.figure_picture", description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.webp")
    args = parser.parse_args()
    views(args.file).save(args.out, "webp", quality=85, method=6)


if __name__ == "__main__":
    sys.exit(main())
