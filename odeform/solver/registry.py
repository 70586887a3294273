"""The methods that `SolverSettings` can name."""

from odeform.errors import InputError
from odeform.solver import tableau
from odeform.solver.linearly_implicit import LinearlyImplicit
from odeform.solver.method import Method
from odeform.solver.runge_kutta import ExplicitRungeKutta

__all__ = ["METHODS", "TITLES", "get_method"]

METHODS: dict[str, Method] = {
    "euler": ExplicitRungeKutta(tableau.EULER),
    "midpoint": ExplicitRungeKutta(tableau.MIDPOINT),
    "rk4": ExplicitRungeKutta(tableau.RK4),
    "bosh3": ExplicitRungeKutta(tableau.BOSH3),
    "dopri5": ExplicitRungeKutta(tableau.DOPRI5),
    "limex": LinearlyImplicit(),
}


TITLES = {
    "euler": "Euler",
    "midpoint": "midpoint rule",
    "rk4": "Runge-Kutta 4",
    "bosh3": "Bogacki-Shampine 3(2)",
    "dopri5": "Dormand-Prince 5(4)",
    "limex": "linearly implicit Euler, extrapolated",
}
"""What a reader of the literature calls each of them."""


def get_method(name: str) -> Method:
    """Returns the method of that name. Raises `InputError` for an unknown one."""
    if name not in METHODS:
        raise InputError(f"unknown solver {name!r}: expected one of {', '.join(METHODS)}")
    return METHODS[name]
