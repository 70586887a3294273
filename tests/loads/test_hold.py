"""Where a held body is held, and by how wide a patch."""

import numpy as np
import pytest

import odeform
from odeform.errors import InputError
from odeform.loads.hold import LOAD, held_towards, held_vertex
from odeform.loads.situation import Clamp
from odeform.simulation.objects.catalog import OBJECTS, get_object
from odeform.types import Mesh

DEFAULTS = {p.name: p.default for p in LOAD.parameters}
WIDTH = next(p for p in LOAD.parameters if p.name == "held_width")


def clamp_of(rest: Mesh, **parameters: float) -> Clamp:
    found = LOAD.situation(rest, {**DEFAULTS, **parameters}).clamp
    assert found is not None
    return found


def test_data_without_a_width_are_held_as_they_were() -> None:
    rest = get_object("donut").rest_mesh()
    older = {name: value for name, value in DEFAULTS.items() if name != WIDTH.name}
    clamp = LOAD.situation(rest, older).clamp
    assert clamp is not None
    assert clamp.radius == pytest.approx(0.12 * np.ptp(rest.points, axis=0).max(), rel=1e-6)
    assert clamp.radius == clamp_of(rest).radius


def test_a_coarse_body_is_held_without_a_width_and_by_none_that_is_narrower() -> None:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float32)
    coarse = Mesh(0.1 * corners, np.array([[0, 1, 3]], dtype=np.int32))
    assert clamp_of(coarse).radius == pytest.approx(0.012)
    with pytest.raises(InputError, match="which holds 1"):
        clamp_of(coarse, held_width=11.0)


def test_a_patch_is_as_wide_as_asked_for_and_as_stiff_in_all() -> None:
    rest = get_object("dog").rest_mesh()
    masses = np.full(len(rest.points), 1.0 / len(rest.points))
    narrow, wide = (clamp_of(rest, held_width=w) for w in (8.0, 24.0))
    assert wide.radius == pytest.approx(3.0 * narrow.radius)
    springs = [clamp.stiffness(rest.points, masses, 1.0) for clamp in (narrow, wide)]
    assert springs[0].sum() == pytest.approx(springs[1].sum())
    assert springs[0].max() > 2.0 * springs[1].max()


@pytest.mark.parametrize("name", OBJECTS)
@pytest.mark.parametrize("width", [WIDTH.low, WIDTH.high])
def test_all_of_the_range_holds_a_part_of_each_object(name: str, width: float) -> None:
    rest, rng = get_object(name).rest_mesh(), np.random.default_rng(0)
    for around, up in zip(rng.uniform(-180.0, 180.0, 50), rng.uniform(-90.0, 90.0, 50), strict=True):
        assert clamp_of(rest, held_width=width, held_around=around, held_up=up).radius > 0.0


@pytest.mark.parametrize(
    ("width", "words"),
    [
        (0.0, "holds nothing"),
        (-3.0, "holds nothing"),
        (float("nan"), "holds nothing"),
        (float("inf"), "holds nothing"),
        (0.01, "which holds 1"),
        (70.0, "holds the whole body"),
        (1e6, "holds the whole body"),
    ],
)
def test_patches_of_nothing_and_of_the_whole_body_are_refused(width: float, words: str) -> None:
    with pytest.raises(InputError, match=words) as found:
        clamp_of(get_object("donut").rest_mesh(), held_width=width)
    assert "\n" not in str(found.value)


def test_the_model_says_so_too_and_moves_otherwise_by_another_patch() -> None:
    model = odeform.load("contact-force:hold")
    given = {"object": "flip-flop", "held_up": 0.0}
    with pytest.raises(InputError, match="whole body"):
        model.solve(parameters={**given, "held_width": 90.0})
    ends = [model.solve(parameters={**given, "held_width": w}).vertices(0.2) for w in (8.0, 12.0, 25.0)]
    default = model.solve(parameters=given).vertices(0.2)
    np.testing.assert_array_equal(default, ends[1])
    assert all(np.isfinite(end).all() for end in ends)
    falls = [float(-(end - model.rest_of({"object": "flip-flop"}).points)[:, 2].min()) for end in ends]
    assert falls[0] > falls[1] + 1e-3, "a wider patch holds more of it"
    assert falls[1] > falls[2] + 1e-3, "a wider patch holds more of it"


@pytest.mark.parametrize("name", OBJECTS)
def test_a_click_holds_what_is_clicked(name: str) -> None:
    """Of places that some angles reach, each is reached to within a patch."""
    rest, rng = get_object(name).rest_mesh(), np.random.default_rng(1)
    size = float(np.ptp(rest.points, axis=0).max())
    for _ in range(20):
        asked = {"held_around": rng.uniform(-180.0, 180.0), "held_up": float(np.degrees(np.arcsin(rng.uniform(-1, 1))))}
        place = rest.points[held_vertex(rest.points, asked)].astype(float)
        found = rest.points[held_vertex(rest.points, held_towards(rest, place))]
        assert np.linalg.norm(found - place) < 0.06 * size


def test_a_click_on_the_inside_of_a_ring_holds_what_is_near() -> None:
    rest = get_object("donut").rest_mesh()
    low, high = rest.points.min(axis=0), rest.points.max(axis=0)
    middle, size = 0.5 * (low + high), float((high - low).max())
    inside = rest.points[((rest.points - middle) ** 2).sum(axis=1).argmin()].astype(float)
    found = rest.points[held_vertex(rest.points, held_towards(rest, inside))]
    straight = inside - middle
    across = rest.points[
        ((rest.points - middle - size * straight / np.linalg.norm(straight)) ** 2).sum(axis=1).argmin()
    ]
    assert np.linalg.norm(found - inside) < np.linalg.norm(across - inside), "better than the angle of the place"
