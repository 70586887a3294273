"""Parameters, windows and schemas of any range."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from properties import PROPERTY

from odeform.schema import Parameter, Schema, Window, soft_clip

NUMBERS = st.floats(-1e6, 1e6, allow_subnormal=False)
NAMES = st.text("abcdefghijklmnopqrstuvwxyz", min_size=1, max_size=6)


@st.composite
def parameters(draw: st.DrawFn, name: str | None = None) -> Parameter:
    scale = draw(st.sampled_from(["linear", "log"]))
    low = draw(st.floats(1e-3, 1e3) if scale == "log" else st.floats(-1e3, 1e3))
    high = low * draw(st.floats(1.5, 100.0)) if scale == "log" else low + draw(st.floats(0.1, 1e3))
    role = draw(st.sampled_from(["physical", "azimuth"]))
    return Parameter(name or draw(NAMES), draw(NAMES), low, high, 0.5 * (low + high), scale, role)


@st.composite
def schemas(draw: st.DrawFn) -> Schema:
    names = draw(st.lists(NAMES, min_size=1, max_size=4, unique=True))
    start, length = draw(st.floats(0.0, 2.0)), draw(st.floats(0.1, 4.0))
    window = Window(start, start + length, draw(st.floats(5.0, 500.0)), draw(st.sampled_from([0.0, 0.5])))
    impact = draw(st.none() | st.just((0.1, 0.5)))
    given = tuple(draw(parameters(name)) for name in names)
    objects = tuple(draw(st.lists(NAMES, max_size=3, unique=True)))
    return Schema(draw(NAMES), given, window, draw(st.booleans()), ("a note",), impact, objects)


@PROPERTY
@given(parameters(), st.floats(-1.5, 1.5))
def test_normalise_inverts_denormalise(parameter: Parameter, unit: float) -> None:
    value = parameter.denormalise(unit)
    assert parameter.normalise(value) == pytest.approx(unit, abs=1e-6)
    assert parameter.inside(value) or abs(unit) > 1.0 - 1e-6
    assert parameter.normalise(parameter.low) == pytest.approx(-1.0)
    assert parameter.normalise(parameter.high) == pytest.approx(1.0)


@PROPERTY
@given(schemas())
def test_schemas_survive_json(schema: Schema) -> None:
    assert Schema.from_json(json.loads(json.dumps(schema.to_json()))) == schema


@PROPERTY
@given(schemas())
def test_older_files_open(schema: Schema) -> None:
    """They have a key `parts`, which nothing used, and those of scenes of one body no `objects`."""
    older = {**schema.to_json(), "parts": ["rigid", "local"]}
    assert Schema.from_json(older) == schema
    assert Schema.from_json({k: v for k, v in older.items() if k != "objects"}) == replace(schema, objects=())


@PROPERTY
@given(st.lists(NUMBERS, min_size=2, max_size=9), st.floats(0.1, 100.0), st.floats(0.01, 10.0))
def test_soft_clip_is_bounded_monotone_and_continuous(values: list[float], limit: float, margin: float) -> None:
    ordered = np.sort(np.array(values))
    clipped = soft_clip(ordered, limit, margin)
    assert np.abs(clipped).max() <= limit + margin
    assert (np.diff(clipped) >= 0.0).all()
    # with slope 1 at most, it is continuous
    assert (np.diff(clipped) <= np.diff(ordered) * (1.0 + 1e-9) + 1e-9 * (limit + margin)).all()
    within = np.abs(ordered) <= limit
    assert np.array_equal(clipped[within], ordered[within])
    assert np.array_equal(soft_clip(-ordered, limit, margin), -clipped)


@PROPERTY
@given(schemas(), st.floats(0.0, 1e6))
def test_clocks_are_bounded_and_exact_within_the_window(schema: Schema, time: float) -> None:
    window = schema.window
    span = window.stop - window.start
    assert window.soft_clamped(np.array([time]))[0] <= window.stop + (window.reach + 0.05) * span + 1e-9
    times = window.times[window.times <= window.stop]
    assert np.array_equal(window.soft_clamped(times), times)
