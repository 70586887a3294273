"""Frames per second of a figure with sliders while it plays, and while a slider is dragged, without a graphics card.

`python -m odeform_figures.speed.figure_frames figure.html` prints them, of Chromium; of Firefox with `--firefox`,
by `xvfb-run -a` where there is no display.
"""

import argparse
from pathlib import Path

from playwright.sync_api import sync_playwright

from odeform_figures.opened_page import CHROMIUM, FLAGS
from odeform_figures.speed.firefox import open_firefox

__all__ = ["frames_per_second"]

SIZES = {"a laptop": (1280, 720), "half of it": (640, 480), "a phone": (390, 844)}
SETTLED, COUNTED = 20, 60  # frames that are drawn before the count begins, and counted
COUNT = """async ([settled, counted, drags]) => {
  const next = () => new Promise((done) => requestAnimationFrame(done));
  while (!(window.figure && window.figure.playing)) await next();
  const slider = document.querySelector("#sliders input");
  const reached = async (frames) => {
    while (window.figure.frames < frames) {
      if (drags) {
        slider.value = String((window.figure.frames % 50) / 50);
        slider.dispatchEvent(new Event("input"));
      }
      await next();
    }
    return performance.now();
  };
  const first = window.figure.frames + settled, begin = await reached(first);
  return (1e3 * counted) / ((await reached(first + counted)) - begin);
}"""


def frames_per_second(file: Path, size: tuple[int, int], drags: bool = False, firefox: bool = False) -> float:
    """Returns how many frames of the figure in `file` are drawn in a second, in a window of `size` pixels.

    With `drags`, its first slider is moved with each frame. `RuntimeError` if the console has an error or a warning.
    """
    address, arguments = file.resolve().as_uri(), [SETTLED, COUNTED, drags]
    if firefox:
        with open_firefox() as browser:
            browser.open(address, size)
            rate = browser.evaluate(COUNT, arguments)
            said = browser.complaints()
    else:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
            page, said = browser.new_page(viewport={"width": size[0], "height": size[1]}), []
            page.on("console", lambda message: said.append(message.text))
            page.on("pageerror", lambda error: said.append(str(error)))
            page.goto(address)
            rate = page.evaluate(COUNT, arguments)
            browser.close()
    if said:
        raise RuntimeError(f"the console says: {said[0]}")
    return float(rate)


def main() -> None:
    """Prints frames per second for windows of several sizes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--firefox", action="store_true", help="instead of Chromium")
    args = parser.parse_args()
    for name, size in SIZES.items():
        playing, dragged = (frames_per_second(args.file, size, drags, args.firefox) for drags in (False, True))
        print(
            f"{name}, {size[0]} x {size[1]}: {playing:.0f} frames per second, {dragged:.0f} while a slider is dragged"
        )


if __name__ == "__main__":
    main()
