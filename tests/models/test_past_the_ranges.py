"""Outside of the trained ranges: how far mechanics goes on, and how the band of errors widens."""

import numpy as np
import pytest

from odeform.models.error_band import OUTSIDE, STRONGER, ErrorBand, excess_of
from odeform.models.registry import load
from odeform.models.rolling.model import RollingModel
from odeform.models.training.outside import growth_of_stronger, growth_outside
from odeform.motion.reduced_motion import ReducedMotion
from odeform.types import Arrays, Floats

TIMES = np.linspace(0.0, 1.0, 21)


def validated(growth: Floats | None = None) -> Arrays:
    rng = np.random.default_rng(0)
    rmse = TIMES * np.exp(0.3 * rng.normal(size=(40, len(TIMES))))
    arrays = {"val.theta": rng.uniform(-1.0, 1.0, (40, 2)), "val.times": TIMES, "val.rmse_mm": rmse}
    return arrays if growth is None else {**arrays, OUTSIDE: growth}


def test_the_band_widens_on_each_side_as_it_was_fitted() -> None:
    growth = np.array([[2.0, 0.0], [0.5, 3.0]])
    band = ErrorBand(validated(growth))
    corner, inside = band.at(np.array([1.0, 1.0]), TIMES)[1:], band.at(np.array([0.3, -1.0]), TIMES)[1:]
    assert band.at(np.array([1.4, 1.2]), TIMES)[1:] == pytest.approx(np.exp(0.4 * 0.5 + 0.2 * 3.0) * corner)
    assert band.at(np.array([0.3, -7.0]), TIMES)[1:] == pytest.approx(inside)
    assert np.isfinite(band.at(np.array([-1e300, 1e300]), TIMES)).all()


def test_growth_is_that_of_the_errors_where_they_grow() -> None:
    """Errors double over 0.1 beyond the first parameter, and shrink beyond the second."""
    rng = np.random.default_rng(1)
    theta = np.concatenate([[[1.0 + by, 0.0], [0.0, -1.0 - by]] for by in rng.uniform(0.05, 0.3, 30)])
    excess = excess_of(theta)
    scale = np.exp(np.log(2.0) / 0.1 * excess[:, 1, 0] - 3.0 * excess[:, 0, 1])[:, None]
    rmse = scale * TIMES[1:] * np.exp(0.2 * rng.normal(size=(60, 20)))
    bands = np.repeat(np.stack([TIMES[1:], 1.3 * TIMES[1:]], axis=1)[None], 60, axis=0)
    growth = growth_outside(theta, rmse, bands)
    assert growth[1, 0] == pytest.approx(np.log(2.0) / 0.1, rel=0.1)
    assert growth[[0, 0, 1], [0, 1, 1]] == pytest.approx(0.0, abs=1e-9)
    widened = bands[..., 1] * np.exp((excess * growth).sum(axis=(1, 2)))[:, None]
    assert (rmse <= widened).mean() >= 0.9


def test_the_band_widens_with_a_push_that_is_stronger_than_in_training() -> None:
    inside, middle = validated(), np.array([0.3, -0.2])
    fitted, plain = ErrorBand({**inside, STRONGER: np.array(1.5)}), ErrorBand(inside)
    assert fitted.at(middle, TIMES, 0.4)[1:] == pytest.approx(np.exp(0.4 * 1.5) * fitted.at(middle, TIMES)[1:])
    wider = plain.at(middle, TIMES, 0.4)[1:] / plain.at(middle, TIMES)[1:]
    assert wider == pytest.approx(np.full_like(wider, wider[0, 0]))
    assert wider[0, 0] > 1.1
    assert np.isfinite(plain.at(middle, TIMES, 1e300)).all()


def test_growth_with_strength_is_enough_for_nine_in_ten() -> None:
    rng = np.random.default_rng(2)
    stronger = np.repeat([0.2, 0.5], 50)
    scores = stronger * rng.normal(1.0, 1.0, 100)
    growth = growth_of_stronger(stronger, scores)
    assert 0.9 <= (scores <= growth * stronger).mean() <= 0.93
    assert growth_of_stronger(stronger, -np.ones(100)) == 0.0
    with pytest.raises(ValueError, match="more motions"):
        growth_of_stronger(stronger[:5], scores[:5])


def test_pushes_beyond_the_strongest_force_have_a_wider_band() -> None:
    """Forces grow to their own strongest of each object, whatever the direction in which they act."""
    model = load("contact-force")
    start = model.complete({"object": "donut"})
    force = np.array([start[f"force_{axis}"] for axis in "xyz"])
    for strength, stronger in ((0.5, 0.0), (1.0, 0.0), (1.25, 0.5)):
        scaled = strength * model.force_range(start)[1] * force / np.linalg.norm(force)
        push = {**start, **dict(zip(("force_x", "force_y", "force_z"), map(float, scaled), strict=True))}
        assert model.stronger(push) == pytest.approx(stronger, abs=1e-9)
        band = model.error_band(push, TIMES[1:4] / 2.0)
        assert band is not None
        known = model.error_band(
            {**push, **{name: push[name] / max(strength, 1.0) for name in push if name.startswith("force")}},
            TIMES[1:4] / 2.0,
        )
        assert known is not None
        assert (band[:, 1] > known[:, 1]).all() == (stronger > 0.0)


@pytest.fixture(scope="module")
def kick() -> RollingModel:
    model = load("kick")
    assert isinstance(model, RollingModel)
    return model


def test_a_stronger_push_throws_farther(kick: RollingModel) -> None:
    """In flight the velocity is the impulse: 10 ms of the peak force for its mass, less gravity."""
    steep = {"elevation": 1.1, "mass": 0.4, "azimuth": 0.0}
    times = np.array([0.05, 0.06])
    for force in (160.0, 200.0, 240.0):
        motion = kick.solve(parameters={**steep, "force": force})
        assert isinstance(motion, ReducedMotion)
        moved = motion.coordinates(times)[:, :3]
        impulse = 0.01 * force / 0.4 * np.array([np.cos(1.1), np.sin(1.1)])
        found = (moved[1] - moved[0])[[0, 2]] / 0.01
        assert found == pytest.approx(impulse - [0.0, 9.81 * 0.055], abs=0.05)


def test_inputs_are_as_asked_for_up_to_half_a_range_beyond(kick: RollingModel) -> None:
    given = kick.schema.complete({"mass": 0.3, "force": 200.0})
    assert np.array_equal(kick.inputs(given), kick.schema.vector(given))
    enormous = kick.inputs({**given, "mass": 1e300, "force": -1e300})
    assert (np.abs(enormous) <= 3.0).all()
    latent = load("mass-elastic")
    assert (np.abs(latent.inputs(latent.schema.complete({"mass": 1e3}))) <= 1.15).all()


@pytest.mark.parametrize("name", ["kick", "mass-elastic/odeform-rolling"])
def test_ten_times_beyond_the_ranges_all_is_finite(name: str) -> None:
    model, rng = load(name), np.random.default_rng(0)
    times = np.linspace(0.0, 2.0 * model.schema.window.stop, 9)
    ends = [{p.name: p.low / 10.0 for p in model.schema.learned}, {p.name: 10.0 * p.high for p in model.schema.learned}]
    drawn = [{p.name: p.denormalise(rng.uniform(-10.0, 10.0)) for p in model.schema.learned} for _ in range(6)]
    for parameters in [*ends, *drawn]:
        motion = model.solve(parameters=parameters, quality="draft")
        assert np.isfinite(motion.vertices(times)).all()
        band = motion.error_band(times)
        assert band is not None
        assert np.isfinite(band).all()
