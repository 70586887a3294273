"""The files that pages take for granted: small, and made by the tests."""

from pathlib import Path

import numpy as np
import trimesh
from authors import TETRAHEDRON, Authors, write_sequence
from blocks import ROOT, blocks_of

from odeform.geometry.primitives import octasphere

__all__ = ["make_files"]

FRAMES = 8
CORNERS = 0.1 * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def make_files(folder: Path) -> None:
    """What the pages name: a scan, the authors' networks and data, and a folder of mesh frames."""
    scan = trimesh.creation.icosphere(subdivisions=3).apply_scale(np.array([30.0, 20.0, 40.0]))
    scan.export(folder / "scan.ply")
    ball = octasphere(0.1, 4)
    trimesh.Trimesh(ball.points, ball.faces).export(folder / "ball.ply")
    trimesh.creation.torus(0.08, 0.03).export(folder / "donut.ply")
    Authors("pemlp", 1).save(folder / "model.pth")
    Authors("pointnet", 3).save(folder / "contact.pth")
    for k in range(3):
        params = {"mass": 0.2 + 0.1 * k, "soft_body_parameters": {"spring": {"bending": 3.0 - 0.2 * k}}}
        heights = 0.5 - 0.01 * np.arange(100.0)
        write_sequence(folder / "released", f"drop_{k}", np.stack([CORNERS] * 100), heights, params)
    throws = folder / "throws"
    for name in ("throw_1", "throw_2"):
        (throws / name).mkdir(parents=True)
        for k in range(FRAMES):
            shape = trimesh.Trimesh(CORNERS + np.array([0.0, 0.0, 0.01 * k]), TETRAHEDRON, process=False)
            shape.export(throws / name / f"frame_{k + 1}.obj")
    table = next(b for b in blocks_of(ROOT / "docs" / "shapes-and-data.md") if b.language == "csv")
    (throws / "parameters.csv").write_text(table.code + "\n")
