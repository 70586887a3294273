"""A geometry seen through a basis: what is computed once per geometry and heading."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from odeform.geometry.rigid import rotation_z
from odeform.geometry.shape import surface_shares
from odeform.model.reduced import ReducedSpace, to_canonical
from odeform.model.triads import Axes, Triads, place_triads
from odeform.types import GaussianSplats, Geometry, Perpoint, Points

__all__ = ["PlacedBasis", "place"]


@dataclass(frozen=True, eq=False)
class PlacedBasis:
    """A geometry, as it lies in the scene at rest: canonical points (N, 3) and values (K, 3 N) of the basis; float32.

    What only some need is computed when first asked for.
    """

    geometry: Geometry
    space: ReducedSpace
    azimuth: float
    points: Points
    rest: Points
    values: Float[np.ndarray, "modes rows"]
    reach: Float[np.ndarray, " modes"]
    """Largest displacement of any point by each mode."""
    shares: Perpoint
    """Share of the surface at each point."""

    @cached_property
    def gram(self) -> Float[np.ndarray, "modes modes"]:
        """Mean products of the modes over the surface: c gram c is the mean square displacement, m^2."""
        shares = np.repeat(self.shares, 3).astype(np.float32)
        return (self.values * shares) @ self.values.T

    @cached_property
    def homogeneous(self) -> Float[np.ndarray, "points 4"]:
        """`rest` and a column of ones: rigid motions are products."""
        return np.concatenate([self.rest, np.ones_like(self.rest[:, :1])], axis=1)

    @cached_property
    def triads(self) -> Triads:
        """The axes at each point and how the basis moves them."""
        return place_triads(self.rest, self.space)

    @cached_property
    def covariances(self) -> Axes:
        """(3, 3, N) covariances of splats in the axes of their triads, m^2."""
        assert isinstance(self.geometry, GaussianSplats)
        axes = rotation_z(self.azimuth) @ self.triads.rest
        half = np.einsum("nik,lkn->iln", self.geometry.covariances, axes)
        return np.einsum("jin,iln->jln", axes, half).astype(np.float32)


def place(geometry: Geometry, space: ReducedSpace, azimuth: float) -> PlacedBasis:
    """Evaluate the basis on a geometry, which lies in the scene as at rest. Once per geometry and azimuth."""
    rest = to_canonical(geometry.points, space.anchor, azimuth)
    values = space.basis.values(rest).transpose(2, 0, 1)
    points = np.asarray(geometry.points, dtype=np.float32)
    reach = np.sqrt(np.einsum("kni,kni->kn", values, values).max(axis=1))
    flat = values.reshape(space.basis.modes, -1)
    shares = surface_shares(geometry)
    return PlacedBasis(geometry, space, azimuth, points, rest.astype(np.float32), flat, reach, shares)
