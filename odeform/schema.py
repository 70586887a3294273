"""Describes what a scene varies: its parameters, with units and ranges, and its window of time."""

import itertools
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.errors import InputError
from odeform.surroundings import Surroundings
from odeform.types import Floats

__all__ = ["LATER", "OBJECT", "REACH", "SHOWN", "Parameter", "Parameters", "Schema", "Window", "soft_clip"]

Parameters = Mapping[str, Any]
"""Name -> value in the unit of its parameter, and "object" -> the name of a body, in a scene with several."""

OBJECT = "object"
"""Name of the parameter that selects one of `Schema.objects`. It is a string, and no `Parameter`."""

BEYOND = 0.15
"""How far inputs may exceed a trained range, in half ranges. The deformations of the bundled models then stay within a
fifth above the largest in training; at 0.25, one in a hundred is several times as large."""
LATER = 0.05
"""How far a model's clock may exceed the trained window and its reach, in windows. A ball at rest then stays so; at
twice that, some motions of the bundled models deform several times as much as ever before, at ten times that, all."""
MOST_FRAMES = 1_000_000
SHOWN = 5e-3
"""How far, relative to it, a number of three digits may be from what it stands for."""
REACH = 3.0
"""Windows beyond the trained one over which models with a continuation keep their clock running."""


def soft_clip(values: Floats, limit: float | Floats, margin: float | Floats) -> Floats:
    """Clip magnitudes smoothly: bit-exact up to `limit`, and never above `limit + margin`; any shape (...).

    Inputs of models pass through this function. Models are therefore continuous functions of a bounded set, and their
    motions stay bounded for any input.
    """
    size = np.abs(values)
    return np.where(size <= limit, values, np.sign(values) * (limit + margin * np.tanh((size - limit) / margin)))


@dataclass(frozen=True)
class Parameter:
    """One physical quantity that a scene varies.

    Attributes:
        name: For example "mass".
        unit: Of all its values, for example "kg".
        low: Lower end of the trained range.
        high: Upper end of the trained range.
        default: Value used where none is given.
        scale: "log" where ratios matter rather than differences (mass, stiffness), otherwise "linear".
        role: "azimuth" for an angle about the vertical axis under which the scene is symmetric. Models rotate
            coordinates by it and do not learn it. "body" for a property of the body itself, which mechanics takes as it
            is: no model learns it. Otherwise "physical".
        description: One line for people.
        shape: Of its value; () for a number.

    Raises:
        InputError: `low` is not below `high`, `default` is outside of them, or `low` is not positive for scale "log".

    Examples:
        >>> import odeform
        >>> mass = odeform.load("kick").schema.parameters[0]
        >>> mass.name, mass.unit, mass.low, mass.high
        ('mass', 'kg', 0.4, 1.5)
        >>> mass.normalise(1.5), mass.inside(2.0)
        (1.0, False)
    """

    name: str
    unit: str
    low: float
    high: float
    default: float
    scale: str = "linear"
    """"log" where ratios matter rather than differences (mass, stiffness), else "linear"."""
    role: str = "physical"
    """"azimuth" for an angle about the vertical axis under which the scene is symmetric: models rotate coordinates by
    it and do not learn it. "body" for a property of the body itself, which mechanics takes as it is."""
    description: str = ""
    shape: tuple[int, ...] = ()
    """Always () for a number; vectors are three parameters NAME_x, NAME_y and NAME_z."""

    def __post_init__(self) -> None:
        if not -math.inf < self.low < self.high < math.inf:
            raise InputError(f"parameter {self.name}: expected finite low < high, got {self.low:g} and {self.high:g}")
        if not self.inside(self.default):
            raise InputError(
                f"parameter {self.name}: expected a default from {self.low:g} to {self.high:g}, got {self.default:g}"
            )
        if self.scale == "log" and self.low <= 0.0:
            raise InputError(f"parameter {self.name}: expected a positive low for scale 'log', got {self.low:g}")

    @property
    def label(self) -> str:
        """The name, with the unit if there is one."""
        return f"{self.name} ({self.unit})" if self.unit else self.name

    def normalise(self, value: float) -> float:
        """Map a value in `unit` so that the trained range becomes [-1, 1]; values outside map outside."""
        if self.scale == "log":
            low, high, value = math.log(self.low), math.log(self.high), math.log(value)
        else:
            low, high = self.low, self.high
        return 2.0 * (value - low) / (high - low) - 1.0

    def denormalise(self, unit: float) -> float:
        """Inverts `normalise`."""
        if self.scale == "log":
            return self.low * (self.high / self.low) ** ((unit + 1.0) / 2.0)
        return self.low + (self.high - self.low) * (unit + 1.0) / 2.0

    def inside(self, value: float) -> bool:
        """Whether a value lies in the trained range, up to rounding: of a property of the body to three digits, as
        sliders show it."""
        slack = SHOWN * abs(value) if self.role == "body" else 1e-6 * (self.high - self.low)
        return bool(self.low - slack <= value <= self.high + slack)

    def check(self, value: Any) -> float:
        """The value as a float, in `unit`. Values outside the trained range are accepted.

        Raises:
            InputError: Not a finite number, not positive where the scale is "log", or a tensor that asks for its
                gradient.
        """
        if getattr(value, "requires_grad", False):
            raise InputError(
                f"{self.name}: expected a number, got a tensor that asks for its gradient; `Predictor.torch` takes one"
            )
        if isinstance(value, bool | np.bool_):
            raise InputError(f"{self.name}: expected a number in {self.unit}, got {value}")
        try:
            number = float(value)
        except (TypeError, ValueError):
            raise InputError(f"{self.name}: expected a number in {self.unit}, got {value!r}") from None
        if not math.isfinite(number):
            raise InputError(f"{self.name}: expected a finite number in {self.unit}, got {number}")
        if self.scale == "log" and number <= 0.0:
            raise InputError(f"{self.name}: expected a positive number in {self.unit}, got {number:g}")
        return number


def _three(name: str, value: Any) -> list[Any]:
    """The components of a vector, given as a sequence or as comma-separated text."""
    try:
        parts = value.split(",") if isinstance(value, str) else list(value)
    except TypeError:
        parts = []
    if len(parts) != 3:
        raise InputError(f"{name}: expected three numbers X,Y,Z, got {value!r}")
    return parts


@dataclass(frozen=True)
class Window:
    """The trained span of time in seconds, and its frame rate in Hz."""

    start: float
    stop: float
    rate: float
    reach: float = 0.0
    """Windows beyond the trained one over which a model extrapolates with its clock running."""

    def __post_init__(self) -> None:
        span = self.stop - self.start
        if not (math.isfinite(self.start) and 0.0 < span < math.inf and 0.0 < self.rate < math.inf):
            raise InputError(f"window: expected start < stop and a rate above 0, got {self}")
        if not 0.0 <= self.reach < math.inf or span * self.rate > MOST_FRAMES:
            raise InputError(f"window: expected at most {MOST_FRAMES:,} frames, and a reach of 0 or more, got {self}")

    @property
    def times(self) -> NDArray[np.float64]:
        """(T,) frame times in seconds, both ends included."""
        count = round((self.stop - self.start) * self.rate)
        return self.start + np.arange(count + 1) / self.rate

    def passed(self, times: Floats) -> Floats:
        """(T,) seconds -> how many trained windows have passed, at least 1."""
        return np.maximum((times - self.start) / (self.stop - self.start), 1.0)

    def soft_clamped(self, times: Floats) -> Floats:
        """(T,) times in seconds as models use them: past the trained span and its reach, the clock slows and stops."""
        span = self.stop - self.start
        return soft_clip(times, self.stop + self.reach * span, LATER * span)


@dataclass(frozen=True)
class Schema:
    """The parameters of a scene and its window of time. A predictor has one, and so has a data set.

    Attributes:
        scene: Its name, for example "kick".
        parameters: In the order of a model's inputs.
        window: The trained span of time in seconds, `start` to `stop`, and its frame `rate` in Hz.
        needs_observations: True for models that interpolate between given frames.
        notes: Remarks for people.
        impact: Half-open span of time in seconds that is also scored separately: free flight and rest dilute scores.
        objects: Names of the bodies of a scene with several. The parameter "object" selects one, by default the first.
        surroundings: Floor, gravity and contacts; None where they are not known.

    Examples:
        >>> import odeform
        >>> schema = odeform.load("kick").schema
        >>> [parameter.name for parameter in schema.parameters]
        ['mass', 'bending', 'force', 'azimuth', 'elevation']
        >>> schema.window.stop, schema.window.rate
        (1.0, 120.0)
        >>> schema.complete({"mass": "0.6"})["mass"]
        0.6
    """

    scene: str
    parameters: tuple[Parameter, ...]
    window: Window
    needs_observations: bool = False
    notes: tuple[str, ...] = ()
    impact: tuple[float, float] | None = None
    objects: tuple[str, ...] = ()
    surroundings: Surroundings | None = None

    @cached_property
    def learned(self) -> tuple[Parameter, ...]:
        """The P parameters that a model learns: all except the azimuth of a symmetric scene, and properties of the body
        itself."""
        return tuple(p for p in self.parameters if p.role == "physical")

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all parameters in order, with "object" first in a scene with objects."""
        return (*[OBJECT] * bool(self.objects), *(p.name for p in self.parameters))

    def azimuth(self, parameters: Parameters) -> float:
        """Returns the azimuth in radians; 0 for a scene without one."""
        return next((parameters[p.name] for p in self.parameters if p.role == "azimuth"), 0.0)

    def complete(self, parameters: Mapping[str, Any] | None) -> dict[str, Any]:
        """Returns all parameters, checked, in the order of the schema, with defaults for those not given.

        Three parameters NAME_x, NAME_y and NAME_z may be given as one vector NAME: three numbers, or "X,Y,Z". In a
        scene with objects the first entry is "object"; all others are floats.

        Raises:
            InputError: An unknown name, or a value that is not acceptable (`Parameter.check`).
        """
        given = self.expanded(parameters)
        body = {OBJECT: self.check_object(given.get(OBJECT, self.objects[0]))} if self.objects else {}
        return body | {p.name: p.check(given.get(p.name, p.default)) for p in self.parameters}

    def expanded(self, parameters: Mapping[str, Any] | None) -> dict[str, Any]:
        """Returns the values as given, with vectors as three numbers each; `InputError` for an unknown name."""
        known = self.names
        given: dict[str, Any] = {}
        for name, value in (parameters or {}).items():
            parts = [f"{name}_{axis}" for axis in "xyz"]
            vector = name not in known and set(parts) <= set(known)
            given |= dict(zip(parts, _three(name, value), strict=True)) if vector else {name: value}
        for name in given:
            if name not in known:
                raise InputError(f"unknown parameter {name!r}: scene {self.scene} has {', '.join(known)}")
        return given

    def check_object(self, name: Any) -> str:
        """The name of an object; `InputError` for one that the scene does not have."""
        if name not in self.objects:
            raise InputError(f"unknown object {name!r}: scene {self.scene} has {', '.join(self.objects) or 'none'}")
        return name

    def with_ranges(self, ranges: Mapping[str, tuple[float, float]]) -> "Schema":
        """Returns the same scene with other ranges, low and high in units of the parameters. Defaults are moved into
        them.

        Raises:
            InputError: An unknown name, a low that is not below its high, or a scene with objects.
        """
        if ranges and self.objects:
            raise InputError(
                f"scene {self.scene}: contacts lie on surfaces, so its parameters have no ranges to choose"
            )
        parameters = {p.name: p for p in self.parameters}
        for name, (low, high) in self.expanded(ranges).items():
            default = min(max(parameters[name].default, low), high)
            parameters[name] = replace(parameters[name], low=low, high=high, default=default)
        return replace(self, parameters=tuple(parameters.values()))

    def known(self, parameters: Mapping[str, Any]) -> dict[str, Any]:
        """The entries of `parameters` that belong to this scene."""
        return {name: parameters[name] for name in self.names if name in parameters}

    def outside(self, parameters: Parameters) -> tuple[str, ...]:
        """Names of the parameters outside their trained range."""
        asked = [p for p in self.parameters if p.role != "azimuth" and p.name in parameters]
        return tuple(p.name for p in asked if not p.inside(parameters[p.name]))

    def vector(self, parameters: Parameters) -> NDArray[np.float64]:
        """(P,) learned parameters, each normalised so that its trained range is [-1, 1]."""
        return np.array([p.normalise(parameters[p.name]) for p in self.learned])

    def inputs(self, parameters: Parameters) -> Floats:
        """Computes (P,) the normalised parameters as inputs of a model: soft-clipped to magnitudes below 1.15."""
        return soft_clip(self.vector(parameters), 1.0, BEYOND)

    def corners(self, reach: float = 1.0) -> list[dict[str, float]]:
        """Corners of the box of trained ranges, scaled by `reach` about its centre; an azimuth keeps its default.

        Raises:
            InputError: The scene has objects. Its contacts lie on their surfaces, and their parameters form no box.
        """
        if self.objects:
            raise InputError(f"scene {self.scene}: contacts lie on surfaces, so its parameters have no corners")
        ends = [
            (p.default,) if p.role == "azimuth" else (p.denormalise(-reach), p.denormalise(reach))
            for p in self.parameters
        ]
        return [{p.name: v for p, v in zip(self.parameters, row, strict=True)} for row in itertools.product(*ends)]

    def to_json(self) -> dict[str, Any]:
        """Plain values, which `from_json` reads."""
        return asdict(self)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> "Schema":
        """The inverse of `to_json`; ignores unknown keys, as older files have. Raises `InputError` for missing ones."""
        try:
            return cls(
                scene=str(data["scene"]),
                parameters=tuple(_parameter(p) for p in data["parameters"]),
                window=Window(**{name: float(value) for name, value in data["window"].items()}),
                needs_observations=bool(data.get("needs_observations", False)),
                notes=tuple(data.get("notes", ())),
                impact=tuple(data["impact"]) if data.get("impact") else None,
                objects=_texts(data.get("objects", ())),
                surroundings=Surroundings.from_json(data["surroundings"]) if data.get("surroundings") else None,
            )
        except InputError:
            raise
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
            raise InputError(f"schema: missing or invalid field of an ODeform scene: {error}") from None


def _parameter(data: Mapping[str, Any]) -> Parameter:
    _texts([data.get(name, "") for name in ("name", "unit", "role")])
    return Parameter(**{**data, "shape": tuple(data.get("shape", ()))})


def _texts(values: Iterable[Any]) -> tuple[str, ...]:
    if isinstance(values, str) or not all(isinstance(value, str) for value in values):
        raise TypeError(f"expected names, got {values!r}")
    return tuple(values)
