"""Error against time of the simulator's own shortcuts, beside the model: `python -m odeform_figures.speed.rivals`.

The same pushes of the test split, on the same machine, in processor time: MuJoCo with longer steps, with coarser meshes
and with cages (a flex whose vertices follow a grid of nodes, with trilinear or quadratic cells), and the qualities of
the model. `--picture FILE.svg` draws them.
"""

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float

from odeform.benchmark.timing import as_viewed
from odeform.dataset.store import open_dataset
from odeform.geometry.contact import checked_contact
from odeform.geometry.solids.solid import solid_inside
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.progress import Progress
from odeform.simulation.errors import SimulationError
from odeform.simulation.flex import FlexBody, flex_xml
from odeform.simulation.objects.body import SoftBody, contact_of
from odeform.simulation.objects.catalog import get_object
from odeform.simulation.objects.settling import calmed
from odeform.simulation.objects.soft_object import SoftObject
from odeform.simulation.physics import GRAVITY
from odeform.simulation.projectile import StruckBody, projectile_xml
from odeform.simulation.scenes.contact_force import COARSE_FROM, PULSE, SCENE, contact_and_force
from odeform.simulation.stepping import run
from odeform.types import Floats, Ints, Mesh, MotionSequence, Points
from odeform_figures.output import write_or_print
from odeform_figures.speed.scatter import scatter

__all__ = ["Rival", "caged", "coarser", "main", "rivals", "simulated"]

# pyright: reportAttributeAccessIssue=false
# MuJoCo is a compiled module without type stubs

OBJECTS, COUNT = ("bottle", "donut"), 2
STEPS = (1.0, 2.0, 4.0)
"""Times the declared step."""
NODES = (800, 400)
CAGES = (("trilinear", 1), ("trilinear", 2), ("trilinear", 4), ("quadratic", 1), ("quadratic", 2))
SETTLING = 1e-3  # s, the step in which a rival comes to rest before it is pushed


@dataclass(frozen=True, eq=False)
class Rival:
    """A coarser model of an object: n nodes that carry the S vertices of its surface."""

    kind: str
    nodes: int
    make: Callable[[float, str], SoftBody]
    """A body, from its step in s and the XML of further bodies."""
    carries: Float[np.ndarray, "vertices nodes"]
    """(S, n) weights of the nodes' places in those of the vertices."""


class _Caged(SoftBody):
    """A flex of which only the nodes of a grid around it move by themselves."""

    def __init__(self, item: SoftObject, order: str, cells: int, step: float, others: str) -> None:
        material = item.material
        elasticity = f'young="{material.young}" poisson="{material.poisson}" damping="{material.damping}"'
        xml = flex_xml(
            item.points,
            item.elements,
            item.mass,
            elasticity,
            contact_of(material),
            step,
            GRAVITY,
            others=others,
            solver='solver="CG" tolerance="1e-6"',
        ).replace("<flexcomp ", f'<flexcomp dof="{order}" cellcount="{cells} {cells} {cells}" ')
        still = mujoco.MjModel.from_xml_string(xml)
        mujoco.mj_forward(still, data := mujoco.MjData(still))
        moving = int(still.nv) // 3  # nodes of empty cells are not; a projectile has one coordinate
        FlexBody.__init__(self, xml, data.xpos[-moving:].copy())
        self._material = material
        self.set_timestep(step)

    def carries(self) -> Float[np.ndarray, "vertices nodes"]:
        """What each node does to each vertex of the flex: vertices are linear in the nodes."""
        still = self.positions
        columns = []
        for node in range(len(still)):
            self.positions = still + np.outer(np.arange(len(still)) == node, [1.0, 0.0, 0.0])
            mujoco.mj_forward(self.model, self.data)
            columns.append(self.data.flexvert_xpos[:, 0].copy())
        self.positions = still
        mujoco.mj_forward(self.model, self.data)
        return np.stack(columns, axis=1) - self.data.flexvert_xpos[:, :1]


def caged(item: SoftObject, order: str, cells: int) -> Rival:
    """The object in a cage of so many cells along each axis, of "trilinear" or "quadratic" ones."""
    carries = _Caged(item, order, cells, SETTLING, "").carries()[: item.surface_count]

    def make(step: float, others: str) -> SoftBody:
        return _Caged(item, order, cells, step, others)

    return Rival(f"{order} cage", carries.shape[1], make, carries)


def coarser(item: SoftObject, nodes: int) -> Rival:
    """The object as a mesh of about so many nodes in place of its own."""
    surface = item.points[: item.surface_count]
    solid = solid_inside(Mesh(surface, item.faces), nodes)

    def make(step: float, others: str) -> SoftBody:
        return SoftBody(solid.points, solid.elements, item.material, step, others=others)

    return Rival("coarser mesh", len(solid.points), make, _inside(surface, solid.points, solid.elements))


def same(item: SoftObject) -> Rival:
    """The object's own mesh, whose steps alone are longer."""

    def make(step: float, others: str) -> SoftBody:
        return SoftBody(item.points, item.elements, item.material, step, others=others)

    return Rival("same mesh", len(item.points), make, np.eye(item.surface_count, len(item.points)))


def _inside(places: Float[np.ndarray, "places 3"], points: Points, elements: Ints) -> Float[np.ndarray, "places nodes"]:
    """(P, n) barycentric weights of places in the nearest of tetrahedra; outside of all they go on linearly."""
    origin = points[elements[:, 0]]
    inverse = np.linalg.inv((points[elements[:, 1:]] - origin[:, None]).swapaxes(1, 2))
    found = np.zeros((len(places), len(points)))
    for row, place in zip(found, places, strict=True):
        inner = np.einsum("mij,mj->mi", inverse, place - origin)
        inner = np.concatenate([1.0 - inner.sum(axis=1, keepdims=True), inner], axis=1)
        best = int(inner.min(axis=1).argmax())
        row[elements[best]] = inner[best]
    return found


def _settled(rival: Rival, item: SoftObject) -> Points:
    """(n, 3) m: the nodes where the rival rests, its surface centred where that of the object is."""
    body = rival.make(SETTLING, "")
    begin = body.positions
    body.positions = begin - [0.0, 0.0, float((rival.carries @ begin)[:, 2].min())]
    found = calmed(body)
    beside = item.weights @ (rival.carries @ found - item.settled[: item.surface_count])
    return found - beside * [1.0, 1.0, 0.0]


def simulated(
    rival: Rival, item: SoftObject, settled: Points, truth: MotionSequence, step: float
) -> tuple[Floats, float]:
    """(T, S, 3) m, displacements of the vertices at the frames of the window; and s of processor time, without those
    in which the body is laid down. Raises `SimulationError`."""
    window, (contact, force) = SCENE.schema.window, contact_and_force(truth.parameters)
    place = checked_contact(item.rest_mesh(), contact, force)[0]
    surface = Mesh((rival.carries @ settled).astype(np.float32), item.faces)
    _, centre = checked_contact(surface, place.moved(surface.points, item.faces), force)
    body = rival.make(step, projectile_xml(centre, force, contact_of(item.material)))
    body.positions = settled
    struck, begin = StruckBody(body, force, PULSE), time.process_time()
    times, nodes = run(struck, COARSE_FROM, window.rate)
    body.set_timestep(2.0 * step)
    later, more = run(struck, window.stop, window.rate, begin=COARSE_FROM)
    nodes = np.concatenate([nodes, more[later > times[-1] + 0.5 / window.rate]])
    moved = np.einsum("sn,tni->tsi", rival.carries, nodes - settled, optimize=True)
    return moved, time.process_time() - begin


def _measured(rival: Rival, item: SoftObject, truths: Sequence[MotionSequence]) -> list[dict[str, Any]]:
    """A row for each step of a rival."""
    about = {"object": item.name, "kind": rival.kind, "nodes": rival.nodes}
    try:
        settled = item.settled if rival.kind == "same mesh" else _settled(rival, item)
    except SimulationError as error:
        return [{**about, "failed": str(error)}]
    rows = []
    for factor in STEPS:
        row, found = {**about, "step_ms": 1e3 * factor * SCENE.step}, []
        try:
            found = [simulated(rival, item, settled, truth, factor * SCENE.step) for truth in truths]
        except (SimulationError, ValueError) as error:
            rows.append({**row, "failed": str(error)})
            continue
        moved = [motion for motion, _ in found]
        rows.append({**row, **_score(moved, truths), "ms": 1e3 * float(np.mean([seconds for _, seconds in found]))})
    return rows


def _score(moved: Sequence[Floats], truths: Sequence[MotionSequence]) -> dict[str, float]:
    pairs = zip(moved, truths, strict=True)
    squares = [np.square(one - (truth.vertices - truth.vertices[0]))[1:].mean() for one, truth in pairs]
    return {"error_mm": 1e3 * float(np.sqrt(np.mean(squares)))}


def _ours(predictor: Predictor, name: str, truths: Sequence[MotionSequence]) -> list[dict[str, Any]]:
    """A row for each quality of the model."""
    rows = []
    for quality in predictor.qualities:
        moved, taken = [], []
        for truth in truths:
            predictor.solve(None, truth.parameters, quality).vertices(truth.times)  # makes what others keep
            begin = time.process_time()
            vertices = predictor.solve(None, truth.parameters, quality).vertices(truth.times)
            taken.append(1e3 * (time.process_time() - begin))
            moved.append(vertices.astype(float) - truth.vertices[0])
        about = {"object": name, "kind": "ODeform (modal)", "quality": quality}
        rows.append({**about, **_score(moved, truths), "ms": float(np.mean(taken))})
    return rows


def rivals(names: Sequence[str], count: int) -> list[dict[str, Any]]:
    """Rows of all methods, on the first `count` test pushes of each object."""
    predictor, dataset, window = load("contact-force"), open_dataset("contact-force"), SCENE.schema.window
    rows, progress = [], Progress("rivals", len(names) * (2 + len(NODES) + len(CAGES)))
    for name in names:
        item = get_object(name)
        truths = [one.frames(window.stop, window.rate) for one in list(dataset.sequences("test", name))[:count]]
        makers: list[Callable[[], Rival]] = [lambda item=item: same(item)]
        makers += [lambda item=item, nodes=nodes: coarser(item, nodes) for nodes in NODES]
        makers += [lambda item=item, cage=cage: caged(item, *cage) for cage in CAGES]
        rows += _ours(predictor, name, truths)
        progress.advance()
        for make in makers:
            rows += _measured(make(), item, truths)
            progress.advance()
    progress.close()
    return rows


def drawn(rows: Sequence[dict[str, Any]]) -> str:
    """The plot of the rows that did not fail, as SVG: a panel for each object."""
    panels: dict[str, dict[str, list[tuple[float, float]]]] = {}
    for row in rows:
        if "failed" not in row:
            panels.setdefault(row["object"], {}).setdefault(row["kind"], []).append((row["ms"], row["error_mm"]))
    return scatter(panels, "processor time of a motion, ms", "error, RMS over coordinates, mm")


def main(argv: Sequence[str] | None = None) -> None:
    """Measure, and print JSON or write it to a file."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.speed.rivals", description=__doc__)
    parser.add_argument("objects", nargs="*", default=list(OBJECTS), metavar="OBJECT", help="default: bottle donut")
    parser.add_argument("--count", type=int, default=COUNT, metavar="N", help=f"pushes of each (default: {COUNT})")
    parser.add_argument("--json", metavar="FILE", help="write the result to this file instead of printing it")
    parser.add_argument("--picture", type=Path, metavar="FILE.svg", help="draw error against time")
    args = parser.parse_args(argv)
    with as_viewed():
        rows = rivals(args.objects, args.count)
    command = f"python -m odeform_figures.speed.rivals {' '.join(args.objects)} --count {args.count}"
    write_or_print({"command": command, "rows": rows}, args.json)
    if args.picture:
        args.picture.write_text(drawn(rows))


if __name__ == "__main__":
    main()
