"""Arrays of checkpoints, checked as they are read."""

from collections.abc import Mapping

import numpy as np

from odeform.types import Arrays

__all__ = ["finite_arrays"]


def finite_arrays(arrays: Arrays, prefix: str, shapes: Mapping[str, tuple[int, ...]]) -> Arrays:
    """Returns the arrays that `shapes` names, without their `prefix`, in double precision.

    KeyError where one is missing, ValueError where one is not finite or has another shape.
    """
    found = {name: arrays[prefix + name].astype(float) for name in shapes}
    for name, shape in shapes.items():
        if found[name].shape != shape or not np.isfinite(found[name]).all():
            raise ValueError(f"{prefix}{name}: expected a finite array of shape {shape}, got {found[name].shape}")
    return found
