"""The bundled scene is what its command makes."""

import sys
from pathlib import Path

import numpy as np
import pytest

from odeform.formats.bundled import bundled_shapes, read_shape, region_beside
from odeform.geometry.shape import fit_to
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.types import GaussianSplats
from odeform_figures.splats import volleyball


@pytest.fixture(scope="module")
def scene() -> GaussianSplats:
    shape, _ = read_shape("volleyball")
    assert isinstance(shape, GaussianSplats)
    return shape


def test_the_command_makes_the_bundled_file(
    scene: GaussianSplats, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = []
    for name in ("a.spz", "b.spz"):
        monkeypatch.setattr(sys, "argv", ["volleyball", "--out", str(tmp_path / name)])
        volleyball.main()
        made.append((tmp_path / name).read_bytes())
    assert made[0] == made[1]
    assert region_beside(tmp_path / "a.spz").read_text() == region_beside(bundled_shapes()["volleyball"]).read_text()
    again, _ = read_shape(tmp_path / "a.spz")
    assert isinstance(again, GaussianSplats)
    assert len(again.points) == len(scene.points)
    # other machines may round the last bit otherwise, and then one step of the format; of a round disc any axes will do
    assert np.abs(again.points - scene.points).max() <= 2.0**-13
    assert np.abs(again.colors - scene.colors).max() < 0.01
    size = np.abs(scene.covariances).max(axis=(1, 2))
    assert (np.abs(again.covariances - scene.covariances).max(axis=(1, 2)) / size).max() < 0.01


def test_the_file_holds_what_was_made(scene: GaussianSplats) -> None:
    """Quantised: within the steps of the format."""
    made = volleyball.FILE.shape(volleyball.volleyball_in_room())
    assert np.abs(scene.points - made.points).max() <= 2.0**-15 + 1e-6
    assert np.abs(scene.colors - made.colors).max() < 0.01
    size, kept = (np.sqrt(np.linalg.eigvalsh(s.covariances)) for s in (made, scene))
    assert np.abs(np.log(kept / size)).max() < 0.04
    thin, same = (np.linalg.eigh(s.covariances)[1][:, :, 0] for s in (made, scene))
    assert np.abs((thin * same).sum(axis=1)).min() > 0.999
    assert bundled_shapes()["volleyball"].stat().st_size < 1e6


def test_its_region_holds_the_ball_and_nothing_else(scene: GaussianSplats) -> None:
    _, region = read_shape("volleyball")
    assert region is not None
    inside = region.contains(scene.points)
    assert inside[: volleyball.BALL].all()
    assert not inside[volleyball.BALL :].any()
    # three colours of panels, darker seams
    nearest = np.linalg.norm(scene.colors[inside][:, None] - 0.95 * volleyball.PANELS, axis=2).argmin(axis=1)
    assert (np.bincount(nearest, minlength=3) > 0.15 * volleyball.BALL).all()


@pytest.mark.parametrize("name", ["kick", "mass-elastic"])
def test_it_fits_the_bodies_at_once(scene: GaussianSplats, name: str) -> None:
    """The ball comes to lie where the body does, upright, on the floor of the room."""
    model: Predictor = load(name)
    _, region = read_shape("volleyball")
    fit = fit_to(scene, model.rest, region)
    for end in (np.min, np.max):
        assert np.allclose(end(fit.geometry.points, axis=0), end(model.rest.points, axis=0), atol=1e-3)
    assert np.array_equal(fit.transform.rotation, volleyball.FILE.rotation.T)
    assert fit.transform.factor == pytest.approx(1.0, abs=0.01)
    assert isinstance(fit.static, GaussianSplats)
    assert fit.static.points[:, 2].min() == pytest.approx(0.0, abs=2e-3)
    assert fit.static.points[:, 2].max() > 1.1
