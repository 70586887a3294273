"""Pictures of later landings, predicted beside simulated, at both extremes of each scene."""

import argparse
from functools import partial
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from odeform.errors import InputError
from odeform.formats.drawing import GREY, View, draw
from odeform.models.registry import load
from odeform.parallel import parallel_map
from odeform.schema import Parameters
from odeform.simulation.scenes.registry import get_scene
from odeform.types import Floats, Mesh, MotionSequence
from odeform_figures.studies.later import RESTS
from odeform_figures.studies.measurements import contacts, measurements_of

__all__ = ["landing", "pictures"]

WINDOWS = 2.0  # trained windows that are simulated
PREDICTED, SIZE, CAPTION = (224, 122, 82), (300, 250), 34
TALL, TILE = 1.9, 0.5  # of the body's size: what a picture shows, and the squares of the floor


def landing(truth: MotionSequence, stop: float) -> int:
    """The frame in which the body is flattest, of the first landing after `stop` seconds; where there is none, of the
    second landing."""
    spans = contacts(truth)[1:]
    later = [span for span in spans if truth.times[span.start] > stop]
    span = (later or spans or [slice(0, None)])[0]
    return int(span.start + np.ptp(truth.vertices[span, :, 2], axis=1).argmin())


def _simulated(name: str, until: float, parameters: Parameters) -> MotionSequence:
    scene = get_scene(name)
    return scene.simulate(parameters) if RESTS in scene.fixed else scene.simulate(parameters, until=until)


def pictures(names: list[str]) -> Image.Image:
    """Draws one column for each extreme of each scene: predicted above, simulated below. `InputError` for scenes
    without."""
    columns = []
    for name in names:
        model = load(name)
        scene, stop = get_scene(model.schema.scene), model.schema.window.stop
        extremes = measurements_of(scene.schema.scene).extremes
        if not extremes:
            raise InputError(f"scene {scene.schema.scene}: has no extremes")
        work = partial(_simulated, scene.schema.scene, WINDOWS * stop)
        for parameters, truth in zip(extremes, parallel_map(f"simulate {name}", work, extremes), strict=True):
            frame = landing(truth, stop)
            moment = float(truth.times[frame])
            shown = model.solve(truth.rest, parameters).vertices(moment)
            difference = 1e3 * float(np.sqrt(np.square(shown - truth.vertices[frame]).mean()))
            print(f"{name} {parameters}: {moment:.3f} s, RMSE {difference:.2f} mm", flush=True)
            soft = parameters is extremes[0]
            said = f"{name}, {'softest' if soft else 'stiffest'}\n{moment:.2f} s, RMSE {difference:.1f} mm"
            columns.append(_column(truth, frame, shown, said))
    whole = Image.new("RGB", (sum(c.width for c in columns), columns[0].height), "white")
    for index, column in enumerate(columns):
        whole.paste(column, (index * column.width, 0))
    return whole


def _column(truth: MotionSequence, frame: int, shown: Floats, said: str) -> Image.Image:
    vertices = truth.vertices[frame]
    size = float(np.ptp(truth.vertices[0], axis=0).max())
    target = np.array([*vertices.mean(axis=0)[:2], 0.4 * size])
    view = View(target, TALL * size, SIZE, TILE * size)
    column = Image.new("RGB", (SIZE[0], 2 * SIZE[1] + CAPTION), "white")
    ImageDraw.Draw(column).multiline_text((8, 4), said, fill="black")
    for row, (points, color) in enumerate(((shown, PREDICTED), (vertices, GREY))):
        picture = draw(Mesh(points, truth.faces), view, color)
        column.paste(Image.fromarray(picture), (0, CAPTION + row * SIZE[1]))
    return column


def main() -> None:
    """Draw the landings and write the picture."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.studies.landings", description=__doc__)
    parser.add_argument("checkpoints", nargs="+", metavar="CKPT", help="bundled checkpoints, by their names")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.webp", help="picture to write")
    args = parser.parse_args()
    try:
        pictures(args.checkpoints).save(args.out, quality=85)
    except InputError as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
