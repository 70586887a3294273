"""The scenes that can be simulated, by name."""

from importlib import import_module

from odeform.errors import InputError
from odeform.loads.registry import load_of_scene
from odeform.schema import Schema
from odeform.simulation.scene import Scene
from odeform.surroundings import Surroundings

__all__ = ["SCENES", "find_scene", "get_scene", "surroundings_of"]

SCENES: dict[str, str] = {
    "mass-elastic": "odeform.simulation.scenes.mass_elastic:SCENE",
    "kick": "odeform.simulation.scenes.kick:SCENE",
    "contact-force": "odeform.simulation.scenes.contact_force:SCENE",
}
"""Scene name to "module:attribute", imported when the scene is first asked for."""


def find_scene(name: str) -> Scene | None:
    """The scene of that name, or None: imported data may belong to a scene that cannot be simulated.

    Raises `InputError` for a scene whose schema has another name than the registry.
    """
    if (load := load_of_scene(name)) is not None:
        from odeform.simulation.scenes.loaded import scene_of

        return scene_of(load)
    if name not in SCENES:
        return None
    module, attribute = SCENES[name].split(":")
    scene: Scene = getattr(import_module(module), attribute)
    if scene.schema.scene != name:
        raise InputError(f"scene {name!r}: expected the same name in its schema, got {scene.schema.scene!r}")
    return scene


def get_scene(name: str) -> Scene:
    """The scene of that name; `InputError` where there is none."""
    scene = find_scene(name)
    if scene is None:
        raise InputError(f"unknown scene {name!r}: expected one of {', '.join(SCENES)}")
    return scene


def surroundings_of(schema: Schema) -> Surroundings | None:
    """Returns what is around the bodies of a schema; None where it is not known, as for imported data.

    Files from before schemas had surroundings get those of the scene that they name.
    """
    if schema.surroundings is not None:
        return schema.surroundings
    scene = find_scene(schema.scene)
    return None if scene is None else scene.surroundings
