"""What a scene varies and shows: parameters, time window, and the parts of its motion."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from odeform.errors import InputError
from odeform.types import Floats

__all__ = ["LATER", "REACH", "Parameter", "Parameters", "Schema", "Window", "soft_clip"]

Parameters = Mapping[str, float]

BEYOND = 0.15
"""How far models see beyond a trained range, in halves of that range: the deformations of the bundled models stay
within a fifth above the largest trained. At a quarter, one in a hundred is several times as large."""
LATER = 0.05
"""How far models see beyond the trained window and its reach, in windows: a ball at rest stays as it is. At twice that,
some motions of the bundled models are deformed several times as much as ever before; at ten times that, all are."""
REACH = 0.5
"""Windows beyond the trained one over which models that go on do so before their clock stops."""


def soft_clip(values: Floats, limit: float, margin: float) -> Floats:
    """Magnitudes up to `limit` to the last bit as they are; beyond, smoothly, ever less, and never by over `margin`.

    What models are asked for passes through here, so that they are continuous functions of a bounded set: whatever is
    asked, the motion stays bounded.
    """
    size = np.abs(values)
    return np.where(size <= limit, values, np.sign(values) * (limit + margin * np.tanh((size - limit) / margin)))


@dataclass(frozen=True)
class Parameter:
    """One physical quantity that a scene varies.

    `scale` is "log" where ratios matter rather than differences (mass, stiffness), else "linear".
    `role` is "azimuth" for an angle about the vertical axis under which the scene is symmetric: models
    rotate coordinates by it and never learn it.
    """

    name: str
    unit: str
    low: float
    high: float
    default: float
    scale: str = "linear"
    role: str = "physical"
    description: str = ""
    shape: tuple[int, ...] = ()

    def normalise(self, value: float) -> float:
        """The trained range maps to [-1, 1]; values beyond it map beyond."""
        if self.scale == "log":
            low, high, value = math.log(self.low), math.log(self.high), math.log(value)
        else:
            low, high = self.low, self.high
        return 2.0 * (value - low) / (high - low) - 1.0

    def denormalise(self, unit: float) -> float:
        if self.scale == "log":
            return self.low * (self.high / self.low) ** ((unit + 1.0) / 2.0)
        return self.low + (self.high - self.low) * (unit + 1.0) / 2.0

    def inside(self, value: float) -> bool:
        slack = 1e-6 * (self.high - self.low)
        return self.low - slack <= value <= self.high + slack

    def check(self, value: Any) -> float:
        """The value as a float. Values outside the trained range pass; what no motion can have does not."""
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
    """The components of a vector, given as a sequence or as text with commas."""
    try:
        parts = value.split(",") if isinstance(value, str) else list(value)
    except TypeError:
        parts = []
    if len(parts) != 3:
        raise InputError(f"{name}: expected three numbers, X,Y,Z, got {value!r}")
    return parts


@dataclass(frozen=True)
class Window:
    """The trained span of time in seconds, and the rate of its frames in Hz."""

    start: float
    stop: float
    rate: float
    reach: float = 0.0
    """Windows beyond the trained one over which a model continues its motions, clocks running on."""

    @property
    def times(self) -> NDArray[np.float64]:
        """(T,) frame times in seconds, both ends included."""
        count = round((self.stop - self.start) * self.rate)
        return self.start + np.arange(count + 1) / self.rate

    def soft_clamped(self, times: Floats) -> Floats:
        """(T,) times as models see them: clocks run ever slower after the trained span and its reach, and soon stop."""
        span = self.stop - self.start
        return soft_clip(times, self.stop + self.reach * span, LATER * span)


@dataclass(frozen=True)
class Schema:
    """Everything a viewer, a trainer or a table needs to know of a scene."""

    scene: str
    parameters: tuple[Parameter, ...]
    window: Window
    parts: tuple[str, ...] = ("rigid", "local")
    needs_observations: bool = False
    notes: tuple[str, ...] = ()
    impact: tuple[float, float] | None = None
    """Half-open span of time in seconds that is scored apart: free flight and rest dilute every score."""

    @property
    def learned(self) -> tuple[Parameter, ...]:
        """The parameters that a model has to learn: all but a symmetry's angle."""
        return tuple(p for p in self.parameters if p.role != "azimuth")

    def azimuth(self, parameters: Parameters) -> float:
        """The scene's angle about the vertical axis in radians; 0 for a scene without one."""
        return next((parameters[p.name] for p in self.parameters if p.role == "azimuth"), 0.0)

    def complete(self, parameters: Mapping[str, Any] | None) -> dict[str, float]:
        """All parameters, checked, in schema order, with defaults where none was given.

        Three parameters NAME_x, NAME_y and NAME_z may be given as one vector: NAME, of three numbers or "X,Y,Z".
        """
        known = [p.name for p in self.parameters]
        given: dict[str, Any] = {}
        for name, value in (parameters or {}).items():
            parts = [f"{name}_{axis}" for axis in "xyz"]
            vector = name not in known and set(parts) <= set(known)
            given |= dict(zip(parts, _three(name, value), strict=True)) if vector else {name: value}
        for name in given:
            if name not in known:
                raise InputError(f"unknown parameter {name!r}: scene {self.scene} has {', '.join(known)}")
        return {p.name: p.check(given.get(p.name, p.default)) for p in self.parameters}

    def known(self, parameters: Mapping[str, Any]) -> dict[str, Any]:
        """Those of `parameters` that this scene varies."""
        return {p.name: parameters[p.name] for p in self.parameters if p.name in parameters}

    def outside(self, parameters: Parameters) -> tuple[str, ...]:
        """Names of the parameters beyond their trained range."""
        return tuple(p.name for p in self.learned if not p.inside(parameters[p.name]))

    def vector(self, parameters: Parameters) -> NDArray[np.float64]:
        """(P,) the learned parameters, each with its trained range mapped to [-1, 1]."""
        return np.array([p.normalise(parameters[p.name]) for p in self.learned])

    def inputs(self, parameters: Parameters) -> Floats:
        """(P,) as `vector`, as models see them: what lies beyond a trained range fades, at most to 1.15."""
        return soft_clip(self.vector(parameters), 1.0, BEYOND)

    def corners(self, reach: float = 1.0) -> list[dict[str, float]]:
        """Those of the trained box, `reach` times as large about its middle; symmetries stay at their default."""
        ends = [
            (p.default,) if p.role == "azimuth" else (p.denormalise(-reach), p.denormalise(reach))
            for p in self.parameters
        ]
        return [{p.name: v for p, v in zip(self.parameters, row, strict=True)} for row in itertools.product(*ends)]

    def to_json(self) -> dict[str, Any]:
        return asdict(self)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> "Schema":
        try:
            return cls(
                scene=str(data["scene"]),
                parameters=tuple(Parameter(**{**p, "shape": tuple(p.get("shape", ()))}) for p in data["parameters"]),
                window=Window(**data["window"]),
                parts=tuple(data["parts"]),
                needs_observations=bool(data.get("needs_observations", False)),
                notes=tuple(data.get("notes", ())),
                impact=tuple(data["impact"]) if data.get("impact") else None,
            )
        except (KeyError, TypeError) as error:
            raise InputError(f"schema: expected the fields of an ODeform scene, missing or wrong: {error}") from None
