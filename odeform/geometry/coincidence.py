"""Rows of numbers that are equal, such as points that coincide."""

import numpy as np

from odeform.types import Floats, Ints

__all__ = ["equal_rows"]


def equal_rows(rows: Floats) -> tuple[Ints, Ints]:
    """Returns the first of each group of equal rows of (N, C), in their order, and the number of each row's group
    (N,)."""
    _, first, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return first[order], rank[inverse.ravel()]
