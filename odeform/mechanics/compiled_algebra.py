"""Small dense linear algebra as machine code: libraries take longer to be called than such matrices to be solved.

Loops go over blocks of rows, so that what is loaded serves several sums, and along memory, so that each loop fills all
lanes of a vector.
"""

from typing import NamedTuple, no_type_check

import numpy as np
from numpy import ndarray

from odeform.compiling import compiled_with

__all__ = ["Rows", "add_squares", "room", "solve"]

compiled = compiled_with(__file__)


class Rows(NamedTuple):
    """Holds Q weighted rows of length N, one coordinate of all of them after the other, and room for two more."""

    columns: ndarray  # (N, Q)
    weights: ndarray  # (Q,)
    first: ndarray  # (Q,)
    second: ndarray  # (Q,)


@compiled
@no_type_check
def room(size, most):
    """Room for up to `most` rows of length `size`."""
    return Rows(np.empty((size, most)), np.empty(most), np.empty(most), np.empty(most))


@compiled
@no_type_check
def add_squares(rows, count, matrix):
    """Add the weighted products of the first `count` rows with themselves to the lower half of a matrix."""
    columns, weights, first, second = rows
    size = len(matrix)
    for i in range(0, size - 1, 2):
        one, two, a, b = columns[i], columns[i + 1], matrix[i], matrix[i + 1]
        for q in range(count):
            first[q], second[q] = weights[q] * one[q], weights[q] * two[q]
        for k in range(0, i + 1, 2):
            left, right = columns[k], columns[k + 1]
            s00 = s01 = s10 = s11 = 0.0
            for q in range(count):
                x, y, u, v = first[q], second[q], left[q], right[q]
                s00 += x * u
                s01 += x * v
                s10 += y * u
                s11 += y * v
            a[k] += s00
            b[k] += s10
            b[k + 1] += s11
            if k < i:  # above the diagonal nothing is kept
                a[k + 1] += s01
    if size % 2:
        one, a = columns[size - 1], matrix[size - 1]
        for k in range(size):
            other, total = columns[k], 0.0
            for q in range(count):
                total += weights[q] * one[q] * other[q]
            a[k] += total


@compiled
@no_type_check
def solve(matrix, right):
    """Overwrite `right` with the solution for the lower half of a positive matrix, which becomes its Cholesky factor;
    false where it is not positive."""
    size = len(right)
    for j in range(size):
        row = matrix[j]
        total, known = row[j], right[j]
        for k in range(j):
            total -= row[k] * row[k]
            known -= row[k] * right[k]
        if not total > 0.0:
            return False
        row[j] = np.sqrt(total)
        inverse = 1.0 / row[j]
        right[j] = known * inverse
        i = j + 1
        while i + 3 < size:
            a, b, c, d = matrix[i], matrix[i + 1], matrix[i + 2], matrix[i + 3]
            ta, tb, tc, td = a[j], b[j], c[j], d[j]
            for k in range(j):
                x = row[k]
                ta -= a[k] * x
                tb -= b[k] * x
                tc -= c[k] * x
                td -= d[k] * x
            a[j], b[j], c[j], d[j] = ta * inverse, tb * inverse, tc * inverse, td * inverse
            i += 4
        while i < size:
            a, ta = matrix[i], matrix[i, j]
            for k in range(j):
                ta -= a[k] * row[k]
            a[j] = ta * inverse
            i += 1
    for j in range(size - 1, -1, -1):
        right[j] /= matrix[j, j]
        value, row = right[j], matrix[j]
        for k in range(j):
            right[k] -= value * row[k]
    return True
