"""What a figure with sliders is made of: the visible models of the page, and ranges of what it sweeps."""

import itertools
from collections.abc import Mapping
from typing import Any

from odeform.errors import InputError
from odeform.figure import MOST_COLUMNS, Source, Sweep
from odeform.models.base import Predictor
from odeform.schema import OBJECT, Parameter, Schema
from odeform_viz.pushing import contacts_of
from odeform_viz.session import settings_of
from odeform_viz.view import ViewRequest
from odeform_viz.words import parameter_title

__all__ = ["figure_choices", "figure_sources"]

WEAK = 0.1  # of the strongest force, below which a component is swept through zero
AROUND = 0.5, 2.0  # times the present force, or the body's own mass and stiffness


def figure_choices(schema: Schema) -> dict[str, tuple[str, ...]]:
    """Labels of what a figure can have sliders for, and the names of the one or two parameters: pairs come first.

    Contacts are left out: they lie on surfaces.
    """
    taken = [p for p in schema.parameters if p.role != "azimuth" and not p.name.startswith("contact_")]
    chosen = [*itertools.combinations(taken, 2), *((each,) for each in taken)]
    return {", ".join(map(parameter_title, each)): tuple(p.name for p in each) for each in chosen}


def figure_sources(request: ViewRequest, names: tuple[str, ...]) -> list[tuple[str, Source]]:
    """Labels and sources of the visible models: with sliders of `names`, or pinned at parameters of their own.

    `InputError` without a visible model, or with too many of them.
    """
    shown = [column for column in request.columns if column.visible and column.predictor]
    if not 1 <= len(shown) <= MOST_COLUMNS:
        raise InputError(f"figure: expected one to {MOST_COLUMNS} visible models, got {len(shown)}")
    out = []
    for column in shown:
        predictor = column.predictor
        assert predictor is not None
        schema = predictor.schema
        known = schema.known(request.parameters if column.pinned is None else column.pinned)
        swept = [p for p in schema.parameters if p.name in names and column.pinned is None]
        sweeps = tuple(_sweep(predictor, parameter, known) for parameter in swept)
        fixed = {name: value for name, value in known.items() if name not in {sweep.name for sweep in sweeps}}
        geometry = column.geometry if column.loaded else None
        still = None if column.fit is None else column.fit.static
        source = Source(predictor, sweeps, fixed, geometry, settings_of(predictor, request.quality), still)
        out.append((column.label, source))
    return out


def _sweep(predictor: Predictor, parameter: Parameter, parameters: Mapping[str, Any]) -> Sweep:
    """Over the trained range; where that is of many bodies, around the body's own value or the present force."""
    if contacts_of(predictor.schema) is None:
        return Sweep(parameter, parameter.low, parameter.high)
    own = predictor.model_of(parameters).own_values
    value, strongest = float(parameters[parameter.name]), predictor.force_range({OBJECT: parameters.get(OBJECT, "")})[1]
    if parameter.name in own:
        value = own[parameter.name]
    elif abs(value) < WEAK * strongest:
        return Sweep(parameter, -0.5 * strongest, 0.5 * strongest)
    low, high = sorted(factor * value for factor in AROUND)
    return Sweep(parameter, low, high)
