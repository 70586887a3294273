"""The inside of what points outline: a scan without faces, or the centres of Gaussian splats."""

import numpy as np
from scipy import ndimage
from scipy.spatial import KDTree

from odeform.errors import InputError
from odeform.geometry.shape import without_outliers
from odeform.geometry.solids.sampled import Enclosed, Sampled
from odeform.types import GaussianSplats, PointCloud, Points

__all__ = ["enclosed_by_points"]

OPAQUE = 0.3  # opacity below which a splat does not outline a body
FEWEST = 300  # points that outline a body
MOST = 300_000  # points; more are thinned out
CELLS = 56  # along the longest side, at most
SPACING = 1.5  # width of a cell, in median distances between neighbouring points
GROWTH = (1, 2, 3, 4)  # cells by which points are thickened until they enclose something
DEEP, FRACTION = 2, 0.25  # fraction of the cells that are deeper than that many cells: less, and nothing is enclosed
INNER, LEAST = 0.35, 2.0  # of the greatest depth, and cells, from which on a point does not outline anything
FOG = 0.4  # density of such points, relative to that of points that fill the inside evenly
SMOOTHING = 1.0  # cells
LEVEL = 0.69  # of the smoothed cells: the surface passes through the points, half a cell within the cells' outline
SLOPE = 0.4  # of the smoothed cells at the surface, for each cell


def enclosed_by_points(geometry: PointCloud | GaussianSplats) -> Enclosed:
    """The solid whose outline points sample, in their units; stray points are left out.

    Raises `InputError` for too few points, and for points that enclose nothing.
    """
    points, notes = np.asarray(geometry.points, dtype=float), []
    if isinstance(geometry, GaussianSplats):
        points = points[geometry.opacities > OPAQUE]
        notes.append(
            f"the surface passes through the centres of {len(points):,} splats of more than {OPAQUE:g} opacity"
        )
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) < FEWEST:
        raise InputError(f"expected at least {FEWEST} points that outline a body, got {len(points)}")
    kept = without_outliers(points[:: -(-len(points) // MOST)])
    size = float(np.ptp(kept, axis=0).max())
    spacing = float(np.median(KDTree(kept).query(kept, 2)[0][:, 1]))
    cell = max(SPACING * spacing, size / CELLS)
    solid = _solid(kept, cell)
    inside = ndimage.gaussian_filter((solid.values < 0.0).astype(float), SMOOTHING)
    depth = solid.edge_distance(inside > LEVEL) * (inside > LEVEL)
    deep = max(INNER * float(depth.max()), LEAST * cell)
    even = float((depth > deep).sum()) / max(float((depth > 0.0).sum()), 1.0)
    if (depth[tuple(solid.indices(kept).T)] > deep).mean() > FOG * even > 0.0:
        raise InputError("the points fill the inside, as fog does: expected points that outline a body")
    near = cell * (LEVEL - inside) / SLOPE
    away = solid.edge_distance(inside > LEVEL)
    distance = np.where(away < cell, near, np.where(inside > LEVEL, -away, away))
    return Enclosed(solid.with_values(distance), tuple(notes))


def _solid(points: Points, cell: float) -> Sampled:
    """Cells that the points enclose: those have a value of -1, others 1."""
    margin = GROWTH[-1] + 4
    shape = np.ceil(np.ptp(points, axis=0) / cell).astype(int) + 2 * margin + 1
    grid = Sampled(np.zeros(shape), points.min(axis=0) - margin * cell, cell)
    outline = np.zeros(shape, dtype=bool)
    outline[tuple(grid.indices(points).T)] = True
    for growth in GROWTH:
        filled = np.asarray(ndimage.binary_fill_holes(ndimage.binary_dilation(outline, iterations=growth)))
        solid = np.asarray(ndimage.binary_erosion(filled, iterations=growth))
        if np.asarray(ndimage.binary_erosion(solid, iterations=DEEP)).sum() > FRACTION * solid.sum():
            return grid.with_values(np.where(solid, -1.0, 1.0))
    raise InputError("the points enclose no volume: their outline is open or flat")
