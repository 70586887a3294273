"""All loads by name."""

from importlib import import_module
from pathlib import Path

from odeform.errors import InputError
from odeform.loads.load import SCENES_OF_LOADS, Load

__all__ = [
    "CLAMPED",
    "LOADS",
    "PUSH",
    "first_body",
    "get_load",
    "known_as",
    "known_loads",
    "load_of_scene",
    "meets_twin",
    "register_load",
    "split_load",
]

CLAMPED = "clamped"
"""The scene of a clamped body, of which nothing is learned."""
PUSH = "push"
"""What happens in the scene `contact-force`, for which models are trained: a sphere pushes."""

LOADS: dict[str, str] = {
    "drop": "odeform.loads.drop:LOAD",
    "throw": "odeform.loads.throw:LOAD",
    "kick": "odeform.loads.kick:LOAD",
    "wall": "odeform.loads.wall:LOAD",
    "step": "odeform.loads.step:LOAD",
    "slope": "odeform.loads.slope:LOAD",
    "hold": "odeform.loads.hold:LOAD",
    "meet": "odeform.loads.meet:LOAD",
}
"""Load name to "module:attribute", imported when the load is first asked for."""

_registered: dict[str, Load] = {}


def register_load(load: Load) -> None:
    """Add a load of one's own. `InputError` for a name that is taken."""
    if load.name in LOADS or load.name == PUSH:
        raise InputError(f"load {load.name!r}: expected a name that is free")
    _registered[load.name] = load


def known_loads() -> tuple[str, ...]:
    """The names of all loads; that of the push is the first."""
    return (PUSH, *LOADS, *_registered)


def get_load(name: str) -> Load:
    """The load of that name; `InputError` where there is none."""
    if name in _registered:
        return _registered[name]
    if name not in LOADS:
        raise InputError(f"unknown load {name!r}: expected one of {', '.join(known_loads())}")
    module, _, attribute = LOADS[name].partition(":")
    return getattr(import_module(module), attribute)


def split_load(name: str) -> tuple[str, str]:
    """The checkpoint and the load of a name such as "contact-force:drop"; the push where it names none."""
    start, separator, end = name.rpartition(":")
    return (start, end) if separator and end in known_loads() and not Path(name).exists() else (name, PUSH)


def load_of_scene(scene: str) -> Load | None:
    """The load that acts in the scene of that name; None in other scenes."""
    name = scene.removeprefix(SCENES_OF_LOADS)
    return get_load(name) if name != scene and name in {*LOADS, *_registered} else None


def meets_twin(scene: str) -> bool:
    """Whether motions of the scene of that name are those of two like bodies."""
    load = load_of_scene(scene)
    return load is not None and load.pairs


def first_body(scene: str, count: int) -> slice:
    """Which of `count` points, of a motion of the scene of that name, are those of the body that something happens to:
    all, or the first half."""
    return slice(count // 2) if meets_twin(scene) else slice(count)


def known_as(scene: str) -> str:
    """What a scene's ranges and its window are those of: "trained", or, under a load, of which no motions were trained,
    "measured"; "shown" where nothing is learned, and sliders and window are as long as is worth seeing."""
    if scene == CLAMPED:
        return "shown"
    return "trained" if load_of_scene(scene) is None else "measured"
