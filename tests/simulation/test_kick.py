import numpy as np
import pytest
import trimesh

from odeform.dataset.index import Dataset
from odeform.geometry.rigid import rotation_z
from odeform.simulation.objects.ball import RADIUS
from odeform.simulation.scenes.kick import ARROW, PULSE, pulse_direction, pulse_weights
from odeform.simulation.scenes.registry import get_scene


def test_the_pulse_comes_from_behind_and_below() -> None:
    rest = np.asarray(trimesh.creation.icosphere(4, RADIUS).vertices)
    weights = pulse_weights(rest, 0.6)
    assert np.isclose(weights.sum(), 1.0)
    struck = weights @ rest
    assert np.allclose(struck / np.linalg.norm(struck), -pulse_direction(0.6), atol=5e-3)


def test_starts_at_rest_on_the_floor(dataset: Dataset) -> None:
    for sequence in dataset.sequences("all"):
        points = sequence.vertices[0]
        assert abs(points[:, 2].min()) < 1e-6
        assert abs(np.linalg.norm(points - sequence.weights @ points, axis=1).mean() - RADIUS) < 1e-6


def test_no_sideways_motion(dataset: Dataset) -> None:
    """Ball, mesh, pulse and floor are mirror images of themselves across the plane of the pulse."""
    for sequence in dataset.sequences("all"):
        canonical = sequence.vertices @ rotation_z(sequence.parameters["azimuth"])
        centre = np.einsum("n,tni->ti", sequence.weights, canonical)
        assert np.abs(centre[:, 1]).max() < 1e-4
        assert centre[:, 0].max() > 0.1


def test_never_far_below_the_floor(dataset: Dataset) -> None:
    for sequence in dataset.sequences("all"):
        assert sequence.vertices[..., 2].min() > -0.01


def test_samples_fill_the_box() -> None:
    scene = get_scene("kick")
    samples = scene.sample(64, seed=5)
    for parameter in scene.schema.parameters:
        units = np.array([parameter.normalise(sample[parameter.name]) for sample in samples])
        # eight in each eighth: what a Sobol sequence promises and chance does not
        assert (np.histogram(units, bins=8, range=(-1.0, 1.0))[0] == 8).all()


def test_longer_samples_start_with_the_shorter() -> None:
    scene = get_scene("kick")
    assert scene.sample(37, seed=5)[:9] == scene.sample(9, seed=5)
    assert scene.sample(9, seed=6) != scene.sample(9, seed=5)


def test_the_arrow_of_the_pulse_is_as_long_as_it_is_strong() -> None:
    scene = get_scene("kick")
    rest = np.asarray(scene.rest_mesh().points)
    parameters = scene.schema.complete({"force": 80.0, "azimuth": 0.5 * np.pi, "elevation": 0.6})
    (arrow,) = scene.glyphs(parameters, rest)
    direction = np.array([0.0, np.cos(0.6), np.sin(0.6)])
    assert np.allclose(arrow.vector, 0.5 * ARROW * 2.0 * RADIUS * direction, atol=1e-9)
    assert np.allclose(arrow.start + arrow.vector, [0.0, 0.0, RADIUS] - RADIUS * direction, atol=1e-9)
    assert (arrow.label, arrow.begin, arrow.end) == ("80 N", 0.0, PULSE)


@pytest.mark.parametrize("elevation", [0.5, 0.6, 0.785, 0.842])
def test_the_arrow_begins_above_the_floor(elevation: float) -> None:
    """For all that sliders reach: they go beyond the trained range by a fifth."""
    scene = get_scene("kick")
    parameters = scene.schema.complete({"force": 160.0, "elevation": elevation})
    points = np.asarray(scene.rest_mesh().points)
    for shape in (points, points * [1.0, 1.0, 0.3]):
        (arrow,) = scene.glyphs(parameters, shape)
        assert arrow.start[2] >= -1e-9


def test_no_arrow_without_the_parameters_of_a_pulse() -> None:
    assert get_scene("kick").glyphs({"mass": 0.6}, np.zeros((4, 3))) == ()
