"""The README's moving picture, from the page itself: `python tests/viz/animation.py --out assets/animation.webp`."""

import argparse
import io
import socket
import time

import numpy as np
from browsing import CHROMIUM, FLAGS
from PIL import Image
from playwright.sync_api import sync_playwright

from odeform.models.registry import load
from odeform_viz.app import App
from odeform_viz.benchmark.client import LoopbackClient
from odeform_viz.columns import Column
from odeform_viz.fitting import shape_from

RATE, QUALITY = 12.5, 60  # pictures a second; of WebP
FILM = (
    # parameters to set, moments to show
    ({"force (N)": 110.0}, np.linspace(0.0, 0.9, 24)),
    ({"force (N)": 150.0, "elevation (rad)": 0.75}, np.linspace(0.0, 0.9, 24)),
)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--out", required=True)
    arguments.add_argument("--width", type=int, default=880)
    args = arguments.parse_args()
    kick = load("kick")
    fit = shape_from("volleyball", kick.rest)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    app = App([Column("odeform", kick, fit.geometry, fit=fit)], port=port)
    pictures: list[Image.Image] = []
    try:
        with sync_playwright() as play:
            browser = play.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
            page = browser.new_page(viewport={"width": 1280, "height": 720})
            page.goto(f"http://127.0.0.1:{port}")
            page.get_by_text("mass (kg)").wait_for(timeout=60_000)
            page.add_style_tag(
                content=".mantine-Notifications-root { display: none }"
            )  # it renders in software, it says
            time.sleep(15.0)  # until the scene is there
            with LoopbackClient(port) as client:
                client.set("time (s)", 0.0)
                client.collect(2.0)
                for setting, moments in FILM:
                    for label, value in setting.items():
                        client.set(label, value)
                    for moment in moments:
                        client.set("time (s)", round(float(moment), 3))
                        client.collect(0.4)
                        shot = Image.open(io.BytesIO(page.screenshot(timeout=60_000))).convert("RGB")
                        pictures.append(shot.resize((args.width, args.width * 720 // 1280), Image.Resampling.LANCZOS))
            browser.close()
    finally:
        app.close()
    options = {"duration": round(1000 / RATE), "loop": 0, "quality": QUALITY, "method": 6}
    pictures[0].save(args.out, save_all=True, append_images=pictures[1:], **options)


if __name__ == "__main__":
    main()
