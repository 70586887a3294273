"""Random input to all controls of the page, some of it invalid."""

from pathlib import Path
from typing import Any

import numpy as np

from odeform_figures.viewer_benchmark.client import Control, LoopbackClient

__all__ = ["send_random_input"]

INVALID_FRACTION, COMMAND_FRACTION = 0.1, 0.05
INVALID_NUMBERS = (float("nan"), float("inf"), -1e9, 1e9)
INVALID_CHOICE = "nonsense"
TETRAHEDRON = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
KIND_WEIGHTS = {
    "Slider": 4.0,
    "Button": 1.0,
    "ButtonGroup": 1.0,
    "Dropdown": 1.0,
    "Checkbox": 1.0,
    "Text": 0.3,
    "Upload": 0.3,
}
# by label: what takes long or fills a disk is rare, and what ends it is frequent
LABEL_WEIGHTS = {
    "Simulate this": 0.02,
    "Map stability": 0.0,  # would use both cores for ten seconds, in which nothing else can be measured
    "Start recording": 0.1,
    "Film (.webp)": 0.1,
    "Cancel": 3.0,
    "Cancel the fit": 3.0,
    "Cancel the film": 3.0,
    "Stop recording": 3.0,
    "Download": 0.2,
}


def send_random_input(client: LoopbackClient, rng: np.random.Generator, folder: Path) -> None:
    """Press a command, or set a visible control to a random value. Recordings are put into `folder`."""
    if rng.random() < COMMAND_FRACTION:
        client.press(str(rng.choice(client.commands)))
        return
    controls = {label: c for label, c in client.controls.items() if c.visible and not c.props.get("disabled")}
    weights = np.array([KIND_WEIGHTS.get(c.kind, 0.3) * LABEL_WEIGHTS.get(label, 1.0) for label, c in controls.items()])
    label = str(rng.choice(list(controls), p=weights / weights.sum()))
    control = controls[label]
    if control.kind == "UploadButton":
        state = next((bytes(f) for n, f in client.downloads.items() if n.endswith(".json")), b"{}")
        contents = {"x.obj": TETRAHEDRON, "x.ply": b"ply\n", "x.json": state, "y.json": b'{"odeform_state": 1}'}
        name = str(rng.choice(list(contents)))
        client.upload(label, name, contents[name])
    else:
        client.set(label, _value(control, rng, folder))


def _value(control: Control, rng: np.random.Generator, folder: Path) -> Any:
    invalid = rng.random() < INVALID_FRACTION
    if control.kind == "Slider":
        return float(
            rng.choice(INVALID_NUMBERS) if invalid else rng.uniform(control.props["min"], control.props["max"])
        )
    if control.kind == "Number":
        return float(rng.choice(INVALID_NUMBERS) if invalid else 10.0 ** rng.uniform(-3.0, 2.0))
    if control.kind in ("Dropdown", "ButtonGroup"):
        return INVALID_CHOICE if invalid else str(rng.choice(control.props["options"]))
    if control.kind == "Vector3":
        return tuple(rng.uniform(-10.0, 110.0, 3).tolist())
    if control.kind == "Text":
        return "" if invalid else str(folder / "soak.rrd")
    return bool(rng.random() < 0.5) if control.kind == "Checkbox" else True
