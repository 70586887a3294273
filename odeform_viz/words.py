"""What names of files and of the library are called on the page, in the words of a reader who knows the field."""

from collections.abc import Mapping

from odeform.loads.registry import known_as
from odeform.models.base import Predictor
from odeform.models.titles import family_title
from odeform.schema import Parameter, Schema
from odeform.simulation.scenes.registry import find_scene

__all__ = [
    "constant_text",
    "description_of",
    "known_range",
    "model_title",
    "notes_of",
    "origin_title",
    "parameter_title",
    "plain",
    "rounded",
    "unit_text",
]

PARAMETERS = {
    "young": "stiffness",
    "beside": "sideways",
    "held_around": "azimuth",
    "held_up": "elevation",
    "held_width": "width",
    "other_turn": "other's turn",
}
CONSTANTS = {
    "young": "Young's modulus",
    "poisson": "Poisson's ratio",
    "viscosity": "viscosity of the wall",
    "pulse": "duration of the force",
    "pulse_spread": "spread of the force",
    "contact_time": "time constant of contacts",
    "projectile_radius": "radius of the sphere",
    "projectile_mass": "mass of the sphere",
    "rest_speed": "speed below which it is at rest",
    "rest_time": "for at least",
    "height": "height of fall",
}
UNITS = {
    "_n_s_m": ("N s/m", 1.0),
    "_m_s2": ("m/s²", 1.0),
    "_m_s": ("mm/s", 1e3),
    "_rad": ("°", 57.29577951308232),
    "_pa": ("kPa", 1e-3),
    "_kg": ("g", 1e3),
    "_m": ("mm", 1e3),
    "_s": ("ms", 1e3),
}
"""How the unit at the end of a constant's name is written, and the factor to it."""


def model_title(predictor: Predictor) -> str:
    """What a model is called over its column; plugged families keep their own names."""
    return family_title(predictor.model)


def origin_title(name: str) -> str:
    """What a bundled checkpoint SCENE/MODEL is called in a list."""
    return family_title(name.rpartition("/")[2])


def known_range(schema: Schema) -> str:
    """What the range of a parameter is: that of the training data, or, under a load for which nothing was trained, that
    in which errors were measured."""
    return f"{known_as(schema.scene)} range"


def parameter_title(parameter: Parameter) -> str:
    """The name of a parameter."""
    return PARAMETERS.get(parameter.name, parameter.name.replace("_", " "))


def description_of(schema: Schema, parameter: Parameter) -> str:
    """What a parameter is: as the scene says it now, since older files keep the words of their time."""
    scene = find_scene(schema.scene)
    known = {p.name: p.description for p in scene.schema.parameters} if scene else {}
    return known.get(parameter.name) or parameter.description


def notes_of(schema: Schema) -> tuple[str, ...]:
    """Remarks on a scene: as it makes them now, or those of the file of one that was imported."""
    scene = find_scene(schema.scene)
    return schema.notes if scene is None else scene.schema.notes


def rounded(value: float, digits: int = 3) -> str:
    """The value with so many digits, and without an exponent."""
    return f"{float(f'{value:.{digits}g}'):g}"


def unit_text(unit: str) -> str:
    """How a unit is written on the page."""
    return "°" if unit == "deg" else unit


def constant_text(name: str, value: float) -> str:
    """A constant of the simulator, such as young_pa, in words with its unit."""
    unit, factor, known = "", 1.0, name
    for ending, (text, scale) in UNITS.items():
        if name.endswith(ending):
            unit, factor, known = text, scale, name.removesuffix(ending)
            break
    title = CONSTANTS.get(known, known.replace("_", " "))
    return f"{title} {factor * value:.4g}{'' if unit == '°' else ' ' if unit else ''}{unit}"


def plain(values: Mapping[str, float], schema: Schema) -> str:
    """Values of learned parameters with their units, as one line."""
    known = {p.name: p for p in schema.parameters}

    def text(name: str, value: float) -> str:
        if (parameter := known.get(name)) is None:  # friction, which has no slider
            return f"{name.replace('_', ' ')} {value:.3g}"
        return f"{parameter_title(parameter)} {value:.3g} {parameter.unit}".rstrip()

    return ", ".join(text(name, value) for name, value in values.items())
