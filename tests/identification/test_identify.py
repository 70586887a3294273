from dataclasses import replace

import numpy as np
import pytest

from odeform.identification import fit
from odeform.identification.discrepancy import Discrepancy
from odeform.identification.fit import ParameterFit
from odeform.identification.identify import Identification, identify
from odeform.identification.linear import Comparison, derivatives, parameters_of
from odeform.identification.observation import Observation
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.solver.integrate import SolverSettings
from odeform.types import PointCloud

AZIMUTH = 0.7
FINE = SolverSettings("dopri5", tolerance=1e-7, dtype="float64")


def certain(predictor: Predictor) -> Discrepancy:
    """A discrepancy of almost nothing."""
    times = predictor.schema.window.times[1:]
    causes, terms = 6 + predictor.solve().space.basis.modes, 1 + len(predictor.schema.learned)
    return Discrepancy(times, np.full((len(times), causes), 1e-6), np.zeros((len(times), causes, terms)))


def observed(predictor: Predictor, theta: np.ndarray, times: np.ndarray, points: int = 40) -> Observation:
    """The model's own motion, at points on the surface that are not vertices."""
    mesh = predictor.rest
    chosen = np.random.default_rng(0).choice(len(mesh.faces), points, replace=False)
    rest = mesh.points[mesh.faces[chosen]].mean(axis=1)
    azimuth = AZIMUTH if predictor.schema.scene == "kick" else 0.0
    motion = predictor.solve(PointCloud(rest), parameters_of(predictor.schema, theta, azimuth), FINE)
    return Observation(rest, times, motion.vertices(times).astype(float), azimuth, 1e-3)


def units(found: Identification) -> np.ndarray:
    return np.array([one.unit for one in found.parameters.values()])


CASES = {"kick/gp": (0.4, -0.7, 0.3, 0.8), "mass-elastic": (-0.35, 0.6)}


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_recovers_the_parameters_of_a_prediction(name: str) -> None:
    predictor, theta = load(name), np.array(CASES[name])
    times = predictor.schema.window.times[1::3]
    found = identify(predictor, observed(predictor, theta, times), certain(predictor))
    assert np.abs(units(found) - theta).max() < 1e-3
    assert found.misfit <= 1.0
    assert all(one.identifiable and one.low <= one.value <= one.high for one in found.parameters.values())


@pytest.mark.slow
def test_recovers_those_of_a_motion_with_landings_within_its_intervals() -> None:
    """Its later frames are no smooth function of the parameters: they count as much as the model knows them."""
    predictor, theta = load("kick"), np.array([0.4, -0.7, 0.3, 0.8])
    found = identify(predictor, observed(predictor, theta, predictor.schema.window.times[1::3]))
    assert np.abs(units(found) - theta).max() < 0.1
    assert found.misfit <= 1.0
    true = [p.denormalise(x) for p, x in zip(predictor.schema.learned, theta, strict=True)]
    assert all(one.low <= value <= one.high for one, value in zip(found.parameters.values(), true, strict=True))


def test_finds_a_corner_of_the_trained_box_step_by_step() -> None:
    predictor, theta = load("mass-elastic"), np.array([-1.0, 1.0])
    steps: list[dict[str, float]] = []
    view = observed(predictor, theta, predictor.schema.window.times[1:60:2])
    found = identify(predictor, view, certain(predictor), steps.append)
    assert np.abs(units(found) - theta).max() < 1e-3
    assert len(steps) > 1
    inside = [p.inside(step[p.name]) for p in predictor.schema.learned for step in steps]
    assert all(inside)


@pytest.mark.parametrize(
    ("ends", "searches"),
    [
        ([(0.5, True)], 1),
        ([(0.5, False), (0.4, False)], 2),
        ([(3.0, True), (0.5, True)], 2),
        ([(3.0, True)] * 5, 5),
    ],
)
def test_searches_from_more_starts_where_the_best_does_not_converge_or_explain(
    monkeypatch: pytest.MonkeyPatch, ends: list[tuple[float, bool]], searches: int
) -> None:
    predictor, left = load("mass-elastic"), list(ends)
    view = observed(predictor, np.zeros(2), predictor.schema.window.times[1::20])
    comparison = Comparison(predictor, view)

    def refined(*_: object) -> ParameterFit:
        return ParameterFit(np.zeros(2), np.eye(2), *left.pop(0))

    monkeypatch.setattr(fit, "_refined", refined)
    best = fit.fit_parameters(comparison, certain(predictor))
    assert len(ends) - len(left) == searches
    assert best.misfit == min(misfit for misfit, _ in ends)


class Cancelled(Exception):
    pass


def test_can_be_cancelled() -> None:
    def cancel(_: object) -> None:
        raise Cancelled

    predictor = load("mass-elastic")
    view = observed(predictor, np.zeros(2), predictor.schema.window.times[1::20])
    with pytest.raises(Cancelled):
        identify(predictor, view, certain(predictor), cancel)


def test_few_noisy_points_give_wider_intervals_that_contain_the_truth() -> None:
    predictor, theta = load("mass-elastic"), np.array(CASES["mass-elastic"])
    clean = observed(predictor, theta, predictor.schema.window.times[2:90:3], points=5)
    noise = np.random.default_rng(0).normal(size=clean.positions.shape)
    noisy = replace(clean, positions=clean.positions + 1e-3 * noise, noise_mm=1.0)
    sure, unsure = (identify(predictor, view, certain(predictor)) for view in (clean, noisy))
    for one, other, truth in zip(sure.parameters.values(), unsure.parameters.values(), theta, strict=True):
        assert other.half_width > 10.0 * one.half_width
        assert abs(other.unit - truth) < 2.0 * other.half_width
        assert other.identifiable


def test_the_expected_model_error_is_subtracted() -> None:
    predictor, theta = load("mass-elastic"), np.array([0.3, -0.4])
    whole = certain(predictor)
    true = observed(predictor, theta, whole.times[:60])  # the first contact is enough
    # a model that is off by 3 mm, and by 2 mm more for each half of the range of mass
    means = whole.means.copy()
    means[:, 2, :2] = 3.0, 2.0
    biased = replace(true, positions=true.positions + np.array([0.0, 0.0, 3.0 + 2.0 * theta[0]]) / 1e3)
    for means_known, close in ((means, True), (whole.means, False)):
        found = identify(predictor, biased, replace(whole, means=means_known))
        error = max(abs(one.unit - truth) for one, truth in zip(found.parameters.values(), theta, strict=True))
        assert (error < 1e-3) == close, error


def test_free_flight_identifies_nothing() -> None:
    """All balls fall alike: until they land, mass and bending change the motion by less than the model error."""
    predictor = load("mass-elastic")
    flight = observed(predictor, np.array([0.5, 0.5]), np.arange(1, 25) / 120.0)
    vague = replace(certain(predictor), variances=np.ones_like(certain(predictor).variances))
    found = identify(predictor, replace(flight, noise_mm=1.0), vague)
    for parameter, one in zip(predictor.schema.learned, found.parameters.values(), strict=True):
        assert not one.identifiable
        assert one.low >= 0.999 * parameter.low
        assert one.high <= 1.001 * parameter.high


def test_unexplained_observations_widen_the_intervals() -> None:
    predictor, theta = load("mass-elastic"), np.array(CASES["mass-elastic"])
    view = observed(predictor, theta, predictor.schema.window.times[1:60:4], points=8)
    other = view.positions + 5e-3 * np.random.default_rng(1).normal(size=view.positions.shape)
    sure, unsure = (
        identify(predictor, replace(view, positions=positions, noise_mm=0.1), certain(predictor))
        for positions in (view.positions, other)
    )
    assert unsure.misfit > 100.0
    assert all(unsure.parameters[name].half_width > 10.0 * one.half_width for name, one in sure.parameters.items())


def test_a_model_without_gradients() -> None:
    predictor, theta = load("mass-elastic/pod-rbf"), np.array(CASES["mass-elastic"])
    times = predictor.schema.window.times[1::6]
    jet = derivatives(predictor, theta, times)
    motions = [
        predictor.solve(None, parameters_of(predictor.schema, theta + shift, 0.0)).trajectory.reduced(times)
        for shift in ([0.0, 2e-3], [0.0, -2e-3])
    ]
    assert np.allclose(jet[2], (motions[0] - motions[1]) / 4e-3, atol=2e-2 * np.abs(jet[2]).max())
    found = identify(predictor, observed(predictor, theta, times), certain(predictor))
    assert np.abs(units(found) - theta).max() < 1e-3


def test_a_model_without_slopes_identifies_nothing() -> None:
    predictor = load("mass-elastic/nearest")
    times = predictor.schema.window.times[1::10]
    found = identify(predictor, observed(predictor, np.zeros(2), times), certain(predictor))
    assert not any(one.identifiable for one in found.parameters.values())
