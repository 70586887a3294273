"""A figure of Gaussian splats: small, and where the model has them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_figure_file import embedded, sweep

from odeform.errors import InputError
from odeform.figure import FigureColumn, Source, column_bytes, figure_page, interpolated
from odeform.figure.packed_splats import packed
from odeform.figure.splats import figure_splats
from odeform.formats.bundled import read_shape
from odeform.geometry.harmonics import harmonic_basis
from odeform.geometry.parts import subset
from odeform.geometry.shape import fit_to
from odeform.models.base import Predictor
from odeform.motion.reduced_motion import as_reduced
from odeform.types import GaussianSplats, PointCloud


def scene(kick: Predictor, degree: int = 3) -> tuple[GaussianSplats, GaussianSplats]:
    """Some splats of a ball, and of the room around it, with harmonics drawn at random."""
    splats, region = read_shape("volleyball")
    fit = fit_to(splats, kick.rest, region)
    parts, rng = [], np.random.default_rng(5)
    for part, count in ((fit.geometry, 3000), (fit.static, 1000)):
        assert isinstance(part, GaussianSplats)
        some = subset(part, np.sort(rng.permutation(len(part.points))[:count]))
        further = 0.1 * rng.standard_normal((count, (degree + 1) ** 2 - 1, 3))
        parts.append(replace(some, harmonics=np.concatenate([some.harmonics, further], axis=1).astype(np.float32)))
    return parts[0], parts[1]


@pytest.fixture(scope="module")
def column(kick: Predictor) -> FigureColumn:
    body, still = scene(kick)
    source = Source(kick, (sweep(kick, "force", 100.0, 130.0),), {"azimuth": 0.7}, body, still=still)
    return interpolated("model", source, kick.schema.window.times[:12], column_bytes(1))


def test_centres_are_as_far_from_the_model_as_the_page_says(kick: Predictor, column: FigureColumn) -> None:
    motion = kick.solve(column.source.geometry, {"force": 110.0, "azimuth": 0.7})
    times = np.array([0.0, 0.011, 0.05])
    apart = column.points(np.array([1.0 / 3.0]), times) - motion.vertices(times)
    assert 1e3 * np.sqrt(np.square(apart).sum(axis=2).mean()) < 2.0 * column.error.worst
    splats = column.body.splats
    assert splats is not None
    assert 0.0 < splats.apart_mm[0] < 0.02
    assert splats.apart_mm[0] < splats.apart_mm[1] < 0.3
    text = figure_page([column]).decode()
    assert f"4,000 splats; centres that move are carried by 800 of them, within {splats.apart_mm[0]:.2g} mm" in text
    assert "by harmonics up to degree 3 (of 3 in the file)" in text


def test_neighbourhoods_deform_as_the_model_says(kick: Predictor, column: FigureColumn) -> None:
    _, (arrays,) = embedded(figure_page([column]))
    motion = as_reduced(kick.solve(column.source.geometry, {"force": 115.0, "azimuth": 0.7}))
    assert column.body.splats is not None
    nodes = column.body.splats.binding.nodes
    y = motion.coordinates(0.011).copy()
    modes = (arrays["basis"] * arrays["steps"][:, None]).reshape(len(arrays["steps"]), -1, 3)
    moved = np.tensordot(y[0, 6:], modes, axes=1)
    slopes = arrays["around_weights"] * arrays["bound_steps"][1]
    axes = arrays["around_axes"].astype(float)
    first = axes[:, :2] + np.einsum("naj,nji->nai", slopes, moved[arrays["around"]])
    normal = np.cross(first[:, 0], first[:, 1])
    carried = np.concatenate([first, (normal / np.linalg.norm(normal, axis=1, keepdims=True))[:, None]], axis=1)
    turn = Rotation.from_euler("z", 0.7).as_matrix() @ Rotation.from_rotvec(y[0, 3:6]).as_matrix()
    gradient = turn @ np.einsum("nai,naj->nij", carried, axes) @ Rotation.from_euler("z", -0.7).as_matrix()
    expected = motion.gradients(0.011)[nodes]
    stretched = np.abs(expected - motion.pose(0.011)[:3, :3]).max()
    assert stretched > 0.1
    assert np.abs(gradient - expected).max() < 0.2 * stretched
    assert np.sqrt(np.square(gradient - expected).mean()) < 0.01


def test_packing_keeps_what_is_seen(kick: Predictor) -> None:
    body, _ = scene(kick)
    out = packed(body, 3, np.arange(len(body.points))).splats
    assert np.abs(out.points - body.points).max() < 1e-5
    apart = np.linalg.norm(out.covariances - body.covariances, axis=(1, 2))
    assert np.quantile(apart / np.linalg.norm(body.covariances, axis=(1, 2)), 0.99) < 0.05
    directions = np.random.default_rng(1).standard_normal((200, 3))
    basis = harmonic_basis(directions / np.linalg.norm(directions, axis=1, keepdims=True), 3)
    colors = [np.clip(0.5 + np.einsum("dh,nhc->dnc", basis, splats.harmonics), 0.0, 1.0) for splats in (out, body)]
    assert np.sqrt(np.square(colors[0] - colors[1]).mean()) < 0.5 / 100
    assert np.abs(out.opacities - body.opacities).max() <= 0.5 / 255 + 1e-6
    one = packed(body, 1, np.array([4, 9])).splats
    np.testing.assert_allclose(one.harmonics[:, 1:], body.harmonics[[4, 9], 1:4], atol=0.01)


def test_what_does_not_fit_goes_by_a_rule(kick: Predictor) -> None:
    body, still = scene(kick)
    every = figure_splats(as_reduced(kick.solve(body)), still)
    assert every.degrees == (3, 3)
    whole = 3000 * (17 + 45 + 16) + 1000 * (17 + 45)
    assert every.within(whole).degrees == (3, 3)
    assert every.within(whole - 1).degrees == (3, 2)
    assert every.within(3000 * (17 + 45 + 16) + 1000 * 17).degrees == (3, 0)
    plain = 3000 * (17 + 16) + 1000 * 17
    assert every.within(plain).shown == (4000, 4000)
    half = every.within(plain // 2)
    assert half.degrees == (0, 0)
    assert half.shown == (2000, 4000)
    assert set(np.diff(half.kept)) <= {2, 3}
    twice = 2.0 * every.body.covariances[half.kept]
    np.testing.assert_allclose(half.moving.splats.covariances, twice, rtol=0.1, atol=0.05 * np.abs(twice).max())
    assert half.moving.splats.points.shape == (1500, 3)
    assert len(half.binding.near) == 1500


def test_thinned_splats_are_said(kick: Predictor) -> None:
    body, still = scene(kick, degree=1)
    source = Source(kick, (sweep(kick, "force", 100.0, 130.0),), {}, body, still=still)
    figure = interpolated("model", source, kick.schema.window.times[:12], 1_500_000)
    assert figure.body.splats is not None
    shown = replace(figure, body=figure.body.within(60_000))
    assert shown.body.splats is not None
    text = figure_page([shown]).decode()
    assert f"{shown.body.splats.shown[0]:,} of 4,000 splats, larger than they are," in text


def test_points_without_faces_are_refused(kick: Predictor) -> None:
    cloud = PointCloud(kick.rest.points)
    with pytest.raises(InputError, match="shows splats, or a mesh with faces, got PointCloud"):
        _ = Source(kick, (sweep(kick, "force", 100.0, 130.0),), {}, cloud).body
