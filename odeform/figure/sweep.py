"""Which parameters a figure has sliders for, and over which values."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.errors import InputError
from odeform.schema import Parameter, Schema
from odeform.types import Floats

__all__ = ["MOST_SWEEPS", "Sweep", "parse_sweeps"]

MOST_SWEEPS = 3


@dataclass(frozen=True)
class Sweep:
    """A slider over the values `low` to `high` of a parameter, in its unit."""

    parameter: Parameter
    low: float
    high: float

    @property
    def name(self) -> str:
        """That of the parameter."""
        return self.parameter.name

    @property
    def logarithmic(self) -> bool:
        """Whether ratios of values matter rather than differences."""
        return self.parameter.scale == "log"

    def values(self, places: Float[np.ndarray, " places"]) -> Floats:
        """Maps places on the slider (P,), from 0 to 1, to values (P,)."""
        if self.logarithmic:
            return np.exp(math.log(self.low) + places * math.log(self.high / self.low))
        return self.low + places * (self.high - self.low)

    def place(self, value: float) -> float:
        """The place of a value: from 0 to 1 on the slider."""
        if self.logarithmic:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


def parse_sweeps(schema: Schema, ranges: Mapping[str, str], fixed: Sequence[str] = ()) -> tuple[Sweep, ...]:
    """Reads LOW:HIGH by name as one to three sweeps of parameters of `schema`; `fixed` are names that have a value.

    Raises:
        InputError: Too many of them, an unknown parameter, one that has no numbers or only turns the scene, one that is
            fixed as well, a range that is none, or is reversed.

    Examples:
        >>> import odeform
        >>> schema = odeform.load("kick").schema
        >>> [(sweep.name, sweep.low, sweep.high) for sweep in parse_sweeps(schema, {"mass": "0.5:1"})]
        [('mass', 0.5, 1.0)]
    """
    if not 1 <= len(ranges) <= MOST_SWEEPS:
        raise InputError(f"--sweep: expected one to {MOST_SWEEPS} parameters, got {len(ranges)}")
    return tuple(_sweep(schema, name, text, fixed) for name, text in ranges.items())


def _sweep(schema: Schema, name: str, text: str, fixed: Sequence[str]) -> Sweep:
    known = {p.name: p for p in schema.parameters if p.role != "azimuth"}
    if name not in known:
        turns = any(p.name == name for p in schema.parameters)
        reason = ", which only turns the scene" if turns else ""
        raise InputError(f"--sweep: expected a parameter out of {', '.join(known)}, got {name!r}{reason}")
    if name in fixed:
        raise InputError(f"--sweep {name}: is given by --set as well; expected it in one of them")
    try:
        low, high = (known[name].check(part) for part in text.split(":"))
    except InputError as error:
        raise InputError(f"--sweep {error}") from None
    except ValueError:
        raise InputError(f"--sweep {name}: expected LOW:HIGH, got {text!r}") from None
    if not low < high:
        raise InputError(f"--sweep {name}: expected LOW below HIGH, got {text}")
    return Sweep(known[name], low, high)
