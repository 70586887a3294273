"""How a shape is drawn, whatever it is made of."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import UInt8

from odeform_viz.colors import Color

__all__ = ["Colors", "Look"]

Colors = UInt8[np.ndarray, "points 3"]


@dataclass(frozen=True, eq=False)
class Look:
    """`colors` (N, 3) in sRGB, None for the shape's own; `opacity` from 0 to 1, None for opaque.

    `tint` colours a shape that has no colours of its own; None for clay.
    """

    colors: Colors | None = None
    opacity: float | None = None
    wireframe: bool = False
    tint: Color | None = None
    dots: bool = False
    """Whether its points are drawn in place of its surface."""
