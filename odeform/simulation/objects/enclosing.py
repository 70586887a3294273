"""A closed surface around what points outline: the centres of Gaussian splats, or of a scan without faces."""

import numpy as np
from scipy import ndimage
from scipy.spatial import KDTree

from odeform.errors import InputError
from odeform.geometry.shape import without_outliers
from odeform.simulation.objects.level_set import surface_of
from odeform.types import Floats, Mesh, Perpoint, Points

__all__ = ["enclosing_surface"]

FEWEST = 300  # points that outline a body
SIZE = 0.4  # m to which the points are scaled meanwhile: `surface_of` works in metres
CELLS = 56  # along the longest side, at most
SPACING = 1.5  # width of a cell, in median distances between neighbouring points
GROWTH = (1, 2, 3, 4)  # cells by which points are thickened until they enclose something
DEEP, FRACTION = 2, 0.25  # fraction of the cells that are deeper than that many cells: less, and nothing is enclosed
SMOOTHING = 1.0  # cells
LEVEL = 0.69  # of the smoothed cells: the surface passes through the points, half a cell within the cells' outline
EDGE = 1.2  # cells, of the surface


def enclosing_surface(points: Points) -> Mesh:
    """The surface of the solid whose outline (N, 3) points sample, in their units; stray points are left out.

    Raises `InputError` for too few points, and for points that enclose nothing.
    """
    if len(points) < FEWEST:
        raise InputError(f"expected at least {FEWEST} points that outline a body, got {len(points)}")
    kept = without_outliers(np.asarray(points, dtype=float))
    low, size = kept.min(axis=0), float(np.ptp(kept, axis=0).max())
    centre = low + 0.5 * np.ptp(kept, axis=0)
    scaled = (kept - centre) * (SIZE / size)
    spacing = float(np.median(KDTree(scaled).query(scaled, 2)[0][:, 1]))
    cell = max(SPACING * spacing, SIZE / CELLS)
    solid, origin = _solid(scaled, cell)
    inside = ndimage.gaussian_filter(solid.astype(float), SMOOTHING)

    def distance(at: Points) -> Perpoint:
        found = ndimage.map_coordinates(inside, ((at - origin) / cell).T, order=1, mode="constant", cval=0.0)
        return cell * (LEVEL - found)

    surface = surface_of(distance, EDGE * cell)
    return Mesh(surface.points * (size / SIZE) + centre, surface.faces)


def _solid(points: Floats, cell: float) -> tuple[np.ndarray, Floats]:
    """Cells (X, Y, Z) bool that the points enclose, and the position (3,) of the first one's middle."""
    margin = GROWTH[-1] + 4
    origin = points.min(axis=0) - margin * cell
    shape = np.ceil(np.ptp(points, axis=0) / cell).astype(int) + 2 * margin + 1
    outline = np.zeros(shape, dtype=bool)
    outline[tuple(np.round((points - origin) / cell).astype(int).T)] = True
    for growth in GROWTH:
        filled = np.asarray(ndimage.binary_fill_holes(ndimage.binary_dilation(outline, iterations=growth)))
        solid = np.asarray(ndimage.binary_erosion(filled, iterations=growth))
        if np.asarray(ndimage.binary_erosion(solid, iterations=DEEP)).sum() > FRACTION * solid.sum():
            return solid, origin
    raise InputError("the points enclose no volume: their outline is open or flat")
