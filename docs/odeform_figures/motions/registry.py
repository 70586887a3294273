"""The kinds of motion by name."""

from odeform_figures.motions import drops, pendulum, throw, vibration, walk
from odeform_figures.motions.kind import Kind

__all__ = ["KINDS"]

KINDS: dict[str, Kind] = {
    "walk": walk.KIND,
    "throw": throw.KIND,
    "vibration": vibration.KIND,
    "pendulum": pendulum.KIND,
    "drops": drops.KIND,
}
