"""Gaussian splats as Rerun draws them: with their ellipsoids, opacities and the colours that depend on the view."""

import numpy as np
import rerun as rr
from jaxtyping import Float, UInt8

from odeform.geometry.ellipsoids import axes_from_covariances
from odeform.types import Floats, GaussianSplats, Points

__all__ = ["ELLIPSOID_BYTES", "ellipsoids", "paint", "splats_at_rest"]

FURTHER = 15  # harmonics of degree 1 to 3, which Rerun holds in half precision
ELLIPSOID_BYTES = 28
"""Of each splat that `ellipsoids` logs."""


def paint(splats: GaussianSplats) -> rr.GaussianSplats3D:
    """What does not move: colours, opacities, and harmonics in the axes of the body at rest, if there are any."""
    return rr.GaussianSplats3D.from_fields(colors=_colors(splats), sh_coefficients=_further(splats))


def ellipsoids(covariances: Float[np.ndarray, "points 3 3"]) -> rr.GaussianSplats3D:
    """Sizes and rotations of (N, 3, 3) m^2."""
    scales, quaternions = _axes(covariances)
    return rr.GaussianSplats3D.from_fields(scales=scales, quaternions=quaternions)


def splats_at_rest(splats: GaussianSplats) -> rr.GaussianSplats3D:
    """All of splats that do not move."""
    centers = np.asarray(splats.points, dtype=np.float32)
    scales, quaternions = _axes(splats.covariances)
    colors, further = _colors(splats), _further(splats)
    return rr.GaussianSplats3D(centers, scales=scales, quaternions=quaternions, colors=colors, sh_coefficients=further)


def _axes(covariances: Floats) -> tuple[Points, Float[np.ndarray, "points 4"]]:
    """Standard deviations in m, and quaternions with w last."""
    sizes, quaternions = axes_from_covariances(covariances)
    return sizes.astype(np.float32), np.roll(quaternions, -1, axis=1).astype(np.float32)


def _colors(splats: GaussianSplats) -> UInt8[np.ndarray, "points 4"]:
    rgba = np.concatenate([splats.colors, np.clip(splats.opacities, 0.0, 1.0)[:, None]], axis=1)
    return np.round(255.0 * rgba).astype(np.uint8)


def _further(splats: GaussianSplats) -> Float[np.ndarray, "points further 3"] | None:
    given = splats.harmonics[:, 1 : FURTHER + 1]
    if not given.shape[1]:
        return None
    return np.pad(given, ((0, 0), (0, FURTHER - given.shape[1]), (0, 0))).astype(np.float16)
