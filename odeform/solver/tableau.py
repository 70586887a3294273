"""Explicit Runge-Kutta methods as Butcher tableaux of exact fractions."""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from odeform.types import Floats

__all__ = ["BOSH3", "DOPRI5", "EULER", "MIDPOINT", "RK4", "Row", "Tableau", "rounded", "row", "rows"]

Row = tuple[Fraction, ...]


@dataclass(frozen=True, eq=False)
class Tableau:
    """Coefficients of a method with s stages. Compared by identity, so that it is a cheap key."""

    name: str
    order: int
    a: tuple[Row, ...]
    """Lower triangle, row i of i entries: the weights of earlier slopes in stage i."""
    b: Row
    """(s,) weights of the slopes in the step."""
    c: Row
    """(s,) nodes, as a fraction of the step."""
    embedded: Row | None = None
    """(s,) weights of the embedded method, whose difference to `b` estimates the error of a step."""
    fsal: bool = False
    """First same as last: the last stage is the first of the next step."""
    middle: Row | None = None
    """(s,) weights for the state at half the step, where the method has a quartic interpolant."""


def rounded(weights: Row, dtype: np.dtype) -> Floats:
    """Returns the fractions (S,) in a precision, each correctly rounded to double precision at least."""
    if dtype.char in "fd":
        return np.array([float(weight) for weight in weights], dtype)
    return np.array([dtype.type(weight.numerator) / dtype.type(weight.denominator) for weight in weights], dtype)


def row(text: str) -> Row:
    """Parses "1/2 0 1" as fractions."""
    return tuple(Fraction(number) for number in text.split())


def rows(*texts: str) -> tuple[Row, ...]:
    """Parses a row of each text."""
    return tuple(row(text) for text in texts)


EULER = Tableau("euler", 1, rows(""), row("1"), row("0"))
MIDPOINT = Tableau("midpoint", 2, rows("", "1/2"), row("0 1"), row("0 1/2"))
RK4 = Tableau("rk4", 4, rows("", "1/2", "0 1/2", "0 0 1"), row("1/6 1/3 1/3 1/6"), row("0 1/2 1/2 1"))
# Bogacki & Shampine 1989, Appl. Math. Lett. 2(4)
BOSH3 = Tableau(
    "bosh3",
    3,
    a=rows("", "1/2", "0 3/4", "2/9 1/3 4/9"),
    b=row("2/9 1/3 4/9 0"),
    c=row("0 1/2 3/4 1"),
    embedded=row("7/24 1/4 1/3 1/8"),
    fsal=True,
)
# Dormand & Prince 1980; state at half a step from Shampine 1986, Math. Comp. 46(173)
DOPRI5 = Tableau(
    "dopri5",
    5,
    a=rows(
        "",
        "1/5",
        "3/40 9/40",
        "44/45 -56/15 32/9",
        "19372/6561 -25360/2187 64448/6561 -212/729",
        "9017/3168 -355/33 46732/5247 49/176 -5103/18656",
        "35/384 0 500/1113 125/192 -2187/6784 11/84",
    ),
    b=row("35/384 0 500/1113 125/192 -2187/6784 11/84 0"),
    c=row("0 1/5 3/10 4/5 8/9 1 1"),
    embedded=row("5179/57600 0 7571/16695 393/640 -92097/339200 187/2100 1/40"),
    fsal=True,
    middle=row(
        "6025192743/60171106304 0 51252292925/130801643196 -2691868925/90256659456 187940372067/3189068634112 "
        "-1776094331/39487288512 11237099/470086768"
    ),
)
