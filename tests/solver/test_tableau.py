from fractions import Fraction

import numpy as np
import pytest

from odeform.errors import InputError
from odeform.solver.registry import get_method
from odeform.solver.runge_kutta import Stages
from odeform.solver.tableau import BOSH3, DOPRI5, EULER, MIDPOINT, RK4, Tableau, rounded

TABLEAUS = (EULER, MIDPOINT, RK4, BOSH3, DOPRI5)
DOPRI5_A = (
    (),
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
)
DOPRI5_ERROR = (
    35 / 384 - 5179 / 57600,
    0.0,
    500 / 1113 - 7571 / 16695,
    125 / 192 - 393 / 640,
    -2187 / 6784 + 92097 / 339200,
    11 / 84 - 187 / 2100,
    -1 / 40,
)
DOPRI5_MIDDLE = (
    6025192743 / 30085553152 / 2,
    0.0,
    51252292925 / 65400821598 / 2,
    -2691868925 / 45128329728 / 2,
    187940372067 / 1594534317056 / 2,
    -1776094331 / 19743644256 / 2,
    11237099 / 235043384 / 2,
)
BOSH3_ERROR = (2 / 9 - 7 / 24, 1 / 3 - 1 / 4, 4 / 9 - 1 / 3, -1 / 8)


def one_step(tableau: Tableau, dtype: type) -> tuple[Stages, list[tuple[float, np.ndarray]]]:
    """A step of 1 s from 0 with slope i the i-th unit vector: states are the weights of the slopes. Also returns the
    times and the states that the field was asked for."""
    units, asked = np.eye(len(tableau.b) + 1, dtype=dtype), []
    stages = Stages(tableau, units[0])

    def field(time: float, state: np.ndarray) -> np.ndarray:
        asked.append((time, state))
        return units[len(asked)]

    stages.step(field, 0.0, np.zeros_like(units[0]), units[0], 1.0)
    return stages, asked


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_weights_are_those_of_the_shipped_scores(dtype: type) -> None:
    """Bit-exact: scores and recordings were computed with these floating-point literals."""
    zero = np.zeros(len(DOPRI5.b) + 1, dtype)
    dopri5, asked = one_step(DOPRI5, dtype)
    for (node, weights), row, true in zip(asked, DOPRI5_A[1:], (1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0), strict=True):
        assert weights.dtype == dtype
        assert np.array_equal(weights[: len(row)], np.array(row, dtype))
        assert node == true
    assert np.array_equal(dopri5.error(1.0)[:-1], np.array(DOPRI5_ERROR, dtype))
    assert np.array_equal(dopri5.middle(zero, 1.0)[:-1], np.array(DOPRI5_MIDDLE, dtype))
    bosh3, _ = one_step(BOSH3, dtype)
    assert np.array_equal(bosh3.error(1.0)[:-1], np.array(BOSH3_ERROR, dtype))


@pytest.mark.skipif(np.finfo(np.longdouble).eps > 1e-18, reason="no extended precision here")
@pytest.mark.parametrize("method", TABLEAUS, ids=lambda tableau: tableau.name)
def test_extended_precision_rounds_every_weight_correctly(method) -> None:
    for row in (*method.a, method.b, method.c, method.embedded or (), method.middle or ()):
        for weight, exact in zip(rounded(row, np.dtype(np.longdouble)), row, strict=True):
            off = Fraction(*weight.as_integer_ratio()) - exact
            assert abs(off) <= abs(exact) * Fraction(2) ** -63


@pytest.mark.skipif(np.finfo(np.longdouble).eps > 1e-18, reason="no extended precision here")
def test_the_middle_of_a_step_gains_from_extended_precision() -> None:
    """dz/dt = 1 has the state 1/2 at half a step from 0, up to rounding."""
    stages = Stages(DOPRI5, np.zeros(1, np.longdouble))
    zero, one = np.zeros(1, np.longdouble), np.ones(1, np.longdouble)
    stages.step(lambda _, z: np.ones_like(z), 0.0, zero, one, 1.0)
    assert abs(float(stages.middle(zero, 1.0)[0] - np.longdouble(0.5))) < 1e-18


@pytest.mark.parametrize("method", TABLEAUS, ids=lambda tableau: tableau.name)
def test_order_conditions_hold_exactly(method) -> None:
    """Row sums, and the quadrature conditions sum b c^(k-1) = 1/k (Hairer, Norsett & Wanner 1993, II.1)."""
    assert all(sum(row) == node for row, node in zip(method.a, method.c, strict=True))
    for weights, order, at in (
        (method.b, method.order, 1),
        (method.embedded, method.order - 1, 1),
        (method.middle, 4, Fraction(1, 2)),
    ):
        for k in range(1, order + 1 if weights else 0):
            assert sum(w * node ** (k - 1) for w, node in zip(weights, method.c, strict=True)) == Fraction(at) ** k / k
    if method.fsal:
        assert (*method.a[-1], 0) == method.b


def test_unknown_method() -> None:
    with pytest.raises(InputError, match="unknown solver 'rk45': expected one of euler, midpoint"):
        get_method("rk45")
