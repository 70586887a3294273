import numpy as np
import trimesh

from odeform.dataset.index import Dataset
from odeform.geometry.rigid import rotation_z
from odeform.simulation.objects.ball import RADIUS
from odeform.simulation.scene import get_scene
from odeform.simulation.scenes.kick import pulse_direction, pulse_weights


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
