"""The pictures of the documentation, taken from the page itself: `python -m odeform_figures.screenshots`.

Needs playwright and Chromium, as `opened_page` does.
"""

from __future__ import annotations

import argparse
import io
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from odeform.cli import run_guarded
from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.formats.writing import write_shape
from odeform.simulation.objects.catalog import OBJECTS, get_object
from odeform.types import Floats
from odeform_figures.bodies.scan import write_shoe
from odeform_figures.opened_page import CHROMIUM, FLAGS, View, opened
from odeform_viz.cli import make_columns
from odeform_viz.columns import Column, truth_column

if TYPE_CHECKING:
    from playwright.sync_api import Browser

__all__ = ["PICTURES", "take"]

SIZE, FILM_SIZE, FILM_WIDTH = (1440, 900), (1280, 720), 880  # px
MOST_BYTES = 120_000  # of a picture
SHOWN = 4  # test sequence of each pushed object
STAGE = (0, 20, 1080, 630)  # px: where two bodies stand side by side
MOMENT = 0.012  # s; the kicked ball is deformed then
LESSON = 1800.0  # s for a few simulated pushes, and what is learned of them
# which `kick/gp` lets sink into the floor
SINKING = {"mass (kg)": 1.38, "bending (N m)": 0.365, "force (N)": 101.0, "elevation (rad)": 0.585}
FILM_RATE, FILM_QUALITY = 12.5, 60  # frames per second; of WebP


def _kick() -> list[Column]:
    return make_columns("kick", (), None)


def _regressed() -> list[Column]:
    return make_columns("kick/gp", (), None)


def _volleyball() -> list[Column]:
    return make_columns("kick", (), "volleyball")


def _donut() -> list[Column]:
    with tempfile.TemporaryDirectory(prefix="odeform-") as folder:
        path = Path(folder) / "donut.ply"
        write_shape(get_object("donut").rest_mesh(), path)
        return make_columns("kick", (), str(path))


def _shoe() -> list[Column]:
    """A soft body of a shape that is like a scan."""
    with tempfile.TemporaryDirectory(prefix="odeform-") as folder:
        path = Path(folder) / "shoe.ply"
        write_shoe(path)
        return make_columns("contact-force", (), str(path))


def _drop() -> list[Column]:
    return make_columns("mass-elastic", (), None)


def _rivals() -> list[Column]:
    sequence = open_dataset("mass-elastic").select("test")[0].name
    return [*make_columns("mass-elastic", ["mass-elastic/pod-rbf"], None), truth_column(f"mass-elastic/{sequence}")]


def _tested() -> list[Column]:
    """The kick, beside a test sequence."""
    sequence = open_dataset("kick").select("test")[SHOWN].name
    return [*_kick(), truth_column(f"kick/{sequence}")]


def _push(name: str = "pillow") -> list[Column]:
    """An object, beside the truth."""
    sequence = open_dataset("contact-force").of(name).select("test")[SHOWN].name
    return [*make_columns("contact-force", (), None), truth_column(f"contact-force/{sequence}")]


def _explore(view: View) -> None:
    view.show(MOMENT)


def _pushed(view: View) -> None:
    view.tab("Compare")
    view.show(0.03)


def _stopped(view: View) -> None:
    for label, value in SINKING.items():
        view.set(label, value)
    view.show(1.5)
    view.wait(lambda: view.app.presenter.settled)
    frame = view.app.presenter.frame
    assert frame is not None
    assert frame.columns[0].stop_at(1.5), "the picture is of a motion that is stopped"


def _compare(view: View) -> None:
    view.tab("Compare")
    view.show(0.3)


def _fit(view: View) -> None:
    view.tab("Compare")
    view.client.click("Fit to the truth")
    view.wait(lambda: "of what is expected" in view.client.text())
    view.show(0.3)
    view.wait(lambda: view.app.presenter.settled)


def _deformation(view: View) -> None:
    view.show(0.3)
    view.set("colour by", "displacement")
    view.set("exaggerate", 2.0)
    view.set("ghost", True)
    view.wait(lambda: view.app.presenter.scale is not None and view.app.presenter.settled)


def _sweeps(view: View) -> None:
    view.tab("Compare")
    view.client.click("Sweep it")
    view.wait(lambda: (frame := view.app.presenter.frame) is not None and len(frame.columns) == 5)
    view.show(0.3)


def _record(view: View) -> None:
    view.tab("Record")
    view.show(MOMENT)


def _help(view: View) -> None:
    view.tab("Help")
    view.show(MOMENT)


def _large_plots(view: View) -> None:
    view.client.press("Larger or smaller plots")
    view.show(0.3)


def _phone(view: View) -> None:
    view.show(MOMENT)
    view.page.get_by_text("ODeform · ball, kicked").first.click()


def _stability(view: View) -> None:
    view.show(MOMENT)
    view.page.get_by_text("Stability map", exact=True).click()
    view.client.click("Map stability")
    drawn = view.page.locator(".odeform-map")
    drawn.wait_for()
    drawn.scroll_into_view_if_needed()


def _simulate(view: View) -> None:
    view.tab("Compare")
    view.show(0.3)
    view.client.click("Simulate this")
    view.wait(lambda: any(column.truth for column in view.app.columns.all))
    view.wait(lambda: (frame := view.app.presenter.frame) is not None and frame.truth is not None)
    view.show(view.largest_error_time())


def _taught(view: View) -> None:
    view.page.get_by_text("Shape", exact=True).click()
    view.set("motions", "10")
    view.client.click("Teach this shape")
    view.wait(lambda: "Taught in" in view.client.text(), LESSON)
    view.wait(lambda: (frame := view.app.presenter.frame) is not None and len(frame.columns) == 2)
    view.show(0.04)
    view.page.get_by_text("Taught in").scroll_into_view_if_needed()


PICTURES: dict[str, tuple[Callable[[], list[Column]], Callable[[View], None]]] = {
    "explore": (_kick, _explore),
    "compare": (_rivals, _compare),
    "deformation": (_drop, _deformation),
    "columns": (_drop, _sweeps),
    "record": (_kick, _record),
    "help": (_kick, _help),
    "stability": (_kick, _stability),
    "splats": (_volleyball, _explore),
    "simulate": (_drop, _simulate),
    "fit": (_tested, _fit),
    "dark": (_rivals, _compare),
    "large-plots": (_rivals, _large_plots),
    "phone": (_kick, _phone),
    "untrained": (_donut, _explore),
    "stopped": (_regressed, _stopped),
    "push": (_push, _pushed),
    "teaching": (_shoe, _taught),
}
"""Name, columns, and what is done before the picture is taken."""
OTHERS = ("animation", "pushed")
"""Made of several views."""

DEVICES: dict[str, dict[str, Any]] = {
    "dark": {"color_scheme": "dark"},
    "phone": {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True},
}
"""Options of the browser's context, for pictures that need some."""


def take(browser: Browser, name: str, out: Path) -> None:
    """Take one of `PICTURES` into the folder `out`, as `NAME.webp`."""
    columns, prepare = PICTURES[name]
    with opened(browser, columns(), SIZE, **DEVICES.get(name, {})) as view:
        prepare(view)
        picture = view.picture()
    (out / f"{name}.webp").write_bytes(_packed(picture))


def _packed(picture: Image.Image) -> bytes:
    """WebP of the highest quality that is small enough."""
    for quality in range(90, 0, -10):
        packed = io.BytesIO()
        picture.save(packed, "webp", quality=quality, method=6)
        if packed.tell() <= MOST_BYTES:
            return packed.getvalue()
    raise ValueError(f"the picture takes more than {MOST_BYTES} bytes at any quality")


@dataclass(frozen=True)
class Shot:
    """A scene of the film: its columns, what is set before it begins, and the times to show in s."""

    columns: Callable[[], list[Column]]
    settings: dict[str, object]
    times: Floats


FILM = (
    Shot(lambda: _loaded("drop"), {"object": "dog", "preset": "on an edge"}, np.linspace(0.0, 0.6, 16)),
    Shot(lambda: _loaded("throw"), {"object": "donut", "preset": "a somersault"}, np.linspace(0.0, 0.75, 20)),
    Shot(lambda: _loaded("kick"), {"object": "bottle"}, np.linspace(0.0, 0.9, 18)),
    Shot(lambda: _loaded("hold"), {"object": "flip-flop"}, np.linspace(0.0, 0.8, 16)),
    Shot(lambda: _push("flip-flop"), {}, np.linspace(0.0, 0.19, 14)),
)


def _loaded(load: str) -> list[Column]:
    """The soft objects under a load."""
    return make_columns(f"contact-force:{load}", (), None)


def _take_film(browser: Browser, out: Path) -> None:
    frames = []
    for shot in FILM:
        with opened(browser, shot.columns(), FILM_SIZE) as view:
            view.show(0.0)
            for label, value in shot.settings.items():
                view.set(label, value)
            view.wait(lambda v=view: v.app.presenter.settled)
            for moment in shot.times:
                view.show(round(float(moment), 4))
                height = FILM_WIDTH * FILM_SIZE[1] // FILM_SIZE[0]
                frames.append(view.picture().resize((FILM_WIDTH, height), Image.Resampling.LANCZOS))
    options = {"duration": round(1000 / FILM_RATE), "loop": 0, "quality": FILM_QUALITY, "method": 6}
    frames[0].save(out, save_all=True, append_images=frames[1:], **options)


def _take_objects(browser: Browser, out: Path) -> None:
    """Every pushed object at its largest deformation, predicted and simulated, as rows of two."""
    parts = []
    for name in OBJECTS:
        with opened(browser, _push(name), SIZE) as view:
            view.page.add_style_tag(content="#odeform-view { display: none }")  # words would lie over the bodies
            view.show(0.0)
            view.set("go to", "peak")
            view.wait(lambda v=view: v.app.clock.time() > 0.0 and v.app.presenter.settled)
            parts.append(view.picture().crop(STAGE))
    width, height = parts[0].width, parts[0].height
    whole = Image.new("RGB", (2 * width, -(-len(parts) // 2) * height), "white")
    for index, part in enumerate(parts):
        whole.paste(part, (index % 2 * width, index // 2 * height))
    small = whole.resize((whole.width * 2 // 3, whole.height * 2 // 3), Image.Resampling.LANCZOS)
    (out / "pushed.webp").write_bytes(_packed(small))


def main() -> int:
    """Run the command; returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m odeform_figures.screenshots",
        description="Take the pictures of the documentation from the page.",
    )
    parser.add_argument("--only", nargs="+", choices=(*PICTURES, *OTHERS), help="take only these")
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"), help="folder (default: docs/pictures)")
    parser.add_argument(
        "--animation", type=Path, default=Path("assets/animation.webp"), help="file (default: assets/animation.webp)"
    )
    args = parser.parse_args()

    def work() -> None:
        if CHROMIUM is None:
            raise InputError("expected Chromium on the PATH, or its path in CHROMIUM")
        from playwright.sync_api import sync_playwright

        args.out.mkdir(parents=True, exist_ok=True)
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
            for name in args.only or (*PICTURES, *OTHERS):
                print(name, flush=True)
                if name == "animation":
                    _take_film(browser, args.animation)
                elif name == "pushed":
                    _take_objects(browser, args.out)
                else:
                    take(browser, name, args.out)
            browser.close()

    return run_guarded(work)


if __name__ == "__main__":
    sys.exit(main())
