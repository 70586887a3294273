"""How long shapes take to become bodies that move, and how near the bodies' surfaces are to them.

Run `python -m odeform_figures.studies.solids FILE ...`, with meshes, point clouds or splats of your own.
"""

import argparse
import time
from pathlib import Path
from typing import Any

import igl
import numpy as np
import trimesh
from jaxtyping import Float
from scipy.spatial import KDTree

from odeform.errors import InputError
from odeform.formats.bundled import read_shape
from odeform.geometry.solids.solid import solid_inside
from odeform.models.base import Predictor
from odeform.models.modal.user_body import UserBodyPredictor, user_body
from odeform.models.registry import load
from odeform.types import Geometry, Mesh
from odeform_figures.output import write_or_print

__all__ = ["measured"]

SAMPLES, MOMENT = 4000, 0.05  # points of the surfaces that are compared; s


def measured(path: Path, trained: Predictor) -> dict[str, Any]:
    """Measures seconds, and distances in per cent of the size, of one shape; says why where it is refused."""
    begin = time.perf_counter()
    geometry, _ = read_shape(path)
    read = time.perf_counter()
    try:
        body = user_body(geometry, path.stem)
        placed = time.perf_counter()
        model = UserBodyPredictor(trained, body)
        motion = model.solve(body.fit.geometry)
        motion.vertices(MOMENT)
    except InputError as error:
        return {"refused": str(error), "seconds": round(time.perf_counter() - begin, 2)}
    shown = time.perf_counter()
    solid = solid_inside(geometry)  # again, as a part of the body that is timed by itself
    made = time.perf_counter()
    surface = Mesh(solid.points[: solid.faces.max() + 1].astype(np.float32), solid.faces)
    away = _distances(surface, geometry)
    return {
        "read_s": round(read - begin, 2),
        "solid_s": round(made - shown, 2),
        "body_s": round(placed - read, 2),
        "first_motion_s": round(shown - placed, 2),
        "moves_s": round(shown - begin, 2),
        "nodes": len(solid.points),
        "off_percent": [round(float(np.quantile(100.0 * away, q)), 2) for q in (0.5, 0.95)],
        "said": body.made,
        "status": motion.status,
    }


def _distances(surface: Mesh, geometry: Geometry) -> Float[np.ndarray, " samples"]:
    """Samples (S,) distances of the solid's surface from the shape, relative to its size."""
    points = trimesh.Trimesh(surface.points, surface.faces, process=False).sample(SAMPLES, seed=0)
    size = float(np.ptp(surface.points, axis=0).max())
    if isinstance(geometry, Mesh):
        shape = np.asarray(geometry.points, dtype=float), np.asarray(geometry.faces, dtype=np.int64)
        return np.sqrt(igl.point_mesh_squared_distance(points, *shape)[0]) / size
    return KDTree(geometry.points).query(points)[0] / size


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.studies.solids", description=__doc__)
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="meshes, point clouds or splats")
    parser.add_argument("--json", type=Path, help="write figures to this file")
    given = parser.parse_args()
    trained = load("contact-force")
    write_or_print({path.name: measured(path, trained) for path in given.files}, given.json)


if __name__ == "__main__":
    main()
