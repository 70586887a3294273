"""Describes what a viewer draws for the parameters of a scene."""

from dataclasses import dataclass

from odeform.types import Vector

__all__ = ["Arrow"]


@dataclass(frozen=True, eq=False)
class Arrow:
    """An arrow from `start` (3,) m along `vector` (3,) m, with a short `label`.

    It stands for something that acts from `begin` to `end`, in seconds of the motion's clock.
    """

    start: Vector
    vector: Vector
    label: str
    begin: float
    end: float
