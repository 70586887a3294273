"""Small linear algebra as machine code agrees with NumPy's."""

import numpy as np
import pytest

from odeform.compiling import compiles

if not compiles():
    pytest.skip("steps run in NumPy", allow_module_level=True)

from odeform.mechanics.compiled_algebra import add_squares, room, solve

SIZES = (1, 2, 3, 4, 5, 6, 7, 9, 36, 37)
ROWS = 11


def _square(size: int) -> np.ndarray:
    rows = np.random.default_rng(size).normal(size=(size + 3, size))
    return rows.T @ rows + 0.1 * np.eye(size)


@pytest.mark.parametrize("size", SIZES)
def test_a_positive_matrix_is_solved_for(size: int) -> None:
    matrix, right = _square(size), np.random.default_rng(1).normal(size=size)
    lower, found = np.tril(matrix) + np.triu(np.full((size, size), np.nan), 1), right.copy()
    assert solve(lower, found)
    assert found == pytest.approx(np.linalg.solve(matrix, right), rel=1e-9, abs=1e-12)
    assert np.tril(lower) == pytest.approx(np.linalg.cholesky(matrix), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("wrong", [-1.0, 0.0, np.nan])
def test_a_matrix_that_is_not_positive_is_refused(size: int, wrong: float) -> None:
    matrix = _square(size)
    matrix[-1, -1] = wrong
    assert not solve(matrix, np.ones(size))


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("count", [0, 1, ROWS])
def test_squares_of_rows_are_added_to_the_lower_half(size: int, count: int) -> None:
    random = np.random.default_rng(size)
    rows, known, matrix = room(size, ROWS), random.normal(size=(ROWS, size)), random.normal(size=(size, size))
    rows.columns[:], rows.weights[:] = known.T, random.uniform(0.1, 2.0, ROWS)
    expected = matrix + (known[:count].T * rows.weights[:count]) @ known[:count]
    before = matrix.copy()
    add_squares(rows, count, matrix)
    assert np.tril(matrix) == pytest.approx(np.tril(expected), rel=1e-12, abs=1e-12)
    assert np.array_equal(np.triu(matrix, 1), np.triu(before, 1))
