"""A short stress run on trained models; each check finds the defect that it is meant to find."""

import itertools
import json
import math
from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from odeform.cli import main
from odeform.dataset.store import open_dataset
from odeform.geometry.rigid import rotation_from_vector
from odeform.models.base import Predictor
from odeform.models.continuation import without_continuation
from odeform.models.latent.model import LatentModel
from odeform.models.registry import load
from odeform.models.solved import SolvedTrajectory
from odeform.motion.reduced_motion import ReducedMotion
from odeform.simulation.physics import energy_gained
from odeform.solver import registry
from odeform.solver.runge_kutta import ExplicitRungeKutta
from odeform.solver.tableau import RK4
from odeform.stress import cases as cases_module
from odeform.stress import consistency, convergence, physics, solvers, stress
from odeform.stress.cases import Case, extreme_cases, methods_of, shapes
from odeform.stress.check import Check
from odeform.stress.stability import map_image, refined_map, stability_map

EXPLICIT = ("euler", "midpoint", "rk4", "bosh3", "dopri5")
REFINED, FINER = (12, 16, 48), (3, 4, 6)  # within the asymptotic range of all methods


@pytest.fixture
def model(predictors: dict[str, Predictor]) -> LatentModel:
    model = predictors["odeform"]
    assert isinstance(model, LatentModel)
    return model


@pytest.fixture
def _short(monkeypatch: pytest.MonkeyPatch) -> None:
    """One motion per check, and no million points."""
    monkeypatch.setattr(cases_module, "SHAPES", cases_module.SHAPES[:-1])
    for module in (consistency, convergence, physics, solvers):
        monkeypatch.setattr(module, "SAMPLES", 1)
    monkeypatch.setattr(solvers, "CALIBRATION", (4, 6))
    monkeypatch.setattr(convergence, "SEQUENCES", 1)
    monkeypatch.setattr(convergence, "REFINED", REFINED)
    monkeypatch.setattr(convergence, "FINER", FINER)


def test_cases_are_distinct_reproducible_and_reach_every_extreme(model: LatentModel) -> None:
    some = extreme_cases(model.schema, methods_of(model), 3000, seed=0)
    assert len(set(some)) == len(some) == 3000
    assert repr(extreme_cases(model.schema, methods_of(model), 3000, seed=0)) == repr(some)
    assert repr(extreme_cases(model.schema, methods_of(model), 3000, seed=1)) != repr(some)
    assert {d.shape for d in some} == set(shapes(model.rest))
    ways = {(d.quality.method, d.quality.dtype) for d in some if d.quality}
    assert ways == set(itertools.product(EXPLICIT, ("float32", "float64")))
    mass = np.array([d.values[0] for d in some])
    assert set(np.round([model.schema.parameters[0].normalise(m) for m in mass if 0.0 < m < 1e9], 6)) >= {
        sign * reach for sign in (-1.0, 1.0) for reach in (1.0, 1.5, 3.0, 10.0)
    }
    few = extreme_cases(model.schema, methods_of(model), 50, seed=0)
    assert len(few) == 50
    assert sum(math.isinf(max(d.values)) for d in some) > 0


def test_bounds() -> None:
    assert Check(1.0, 1.0).holds
    assert not Check(1.1, 1.0).holds
    assert Check(0.9, 0.9, at_least=True).holds
    assert not Check(0.8, 0.9, at_least=True).holds
    assert not Check(math.nan, 1.0).holds
    assert not Check(math.inf, 1.0, at_least=True).holds


@pytest.mark.slow
@pytest.mark.usefixtures("_short")
@pytest.mark.parametrize("name", ["odeform", "pod-rbf"])
def test_short_run(trained: dict[str, Path], tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    out, cases = tmp_path / "stress.json", 30
    code = main(["stress", str(trained[name]), "--cases", str(cases), "--draws", "12", "--json", str(out)])
    result = json.loads(out.read_text())
    assert code == (0 if all(check["holds"] for check in result["checks"].values()) else 1)
    assert set(result) == {"cases", "non_finite_shown", "by_status", "inside", "checks"}
    assert result["inside"]["draws"] == 12
    assert result["cases"] == sum(result["by_status"].values()) == cases
    assert result["non_finite_shown"] == 0
    assert {"ok", "ok, outside the trained box", "refused"} <= set(result["by_status"])
    assert not any(status.startswith("fault") for status in result["by_status"])
    said = capsys.readouterr().out
    for check, row in result["checks"].items():
        assert set(row) == {"holds", "figure", "bound"}
        assert check in said
    sure = {"faults", "non_finite_frames", "start_off_m", "grid_invariance_m", "scrub_order_m", "determinism_m"}
    sure |= {"batch_invariance_m", "single_precision_mm", "shown_below_floor_mm", "shown_non_finite_frames"}
    if name == "odeform":
        sure |= {f"order_{method}_deviation" for method in EXPLICIT}
        sure |= {"sensitivity_relative", "solver_error_rank_correlation", "solver_error_within_factor_2"}
    assert sure <= set(result["checks"])
    assert [check for check in sure if not result["checks"][check]["holds"]] == []


@pytest.mark.slow
def test_a_wrong_coefficient_lowers_the_order(model: LatentModel, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(convergence, "SAMPLES", 1)
    monkeypatch.setattr(convergence, "REFINED", REFINED)
    monkeypatch.setattr(convergence, "methods_of", lambda _: ("midpoint", "rk4"))
    wrong = tuple(Fraction(1, part) for part in (6, 3, 6, 3))
    monkeypatch.setitem(registry.METHODS, "rk4", ExplicitRungeKutta(replace(RK4, b=wrong)))
    checks = convergence.check_orders(model)
    assert [name for name, check in checks.items() if not check.holds] == ["order_rk4_deviation"]


def test_wrong_derivatives_are_found(model: LatentModel, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(solvers, "SAMPLES", 1)
    assert solvers.check_sensitivities(model)["sensitivity_relative"].holds
    sound = LatentModel.sensitivities
    monkeypatch.setattr(LatentModel, "sensitivities", lambda *asked: 1.1 * sound(*asked))
    assert not solvers.check_sensitivities(model)["sensitivity_relative"].holds


@pytest.mark.slow
def test_refining_that_increases_the_error_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(convergence, "methods_of", lambda _: ("rk4",))
    model, dataset = load("mass-elastic"), open_dataset("mass-elastic")
    assert isinstance(model, LatentModel)
    assert convergence.check_refining(model, dataset)["refining_error_ratio"].holds
    sound = LatentModel.solve

    def drifting(self: LatentModel, shape: Any, parameters: Any, quality: Any) -> ReducedMotion:
        heavier = {**parameters, "mass": parameters["mass"] * (1.0 + 1e-5 / quality.step)}
        return sound(self, shape, heavier, quality)

    monkeypatch.setattr(LatentModel, "solve", drifting)
    assert not convergence.check_refining(model, dataset)["refining_error_ratio"].holds


def _outcomes(model: LatentModel, cases: Iterable[Case]) -> list[stress.Outcome]:
    geometries = shapes(model.rest)
    return [stress.run_case(model, case, geometries) for case in cases]


def _some_cases(model: LatentModel) -> list[Case]:
    return extreme_cases(model.schema, methods_of(model), 3000, seed=0)[-20:]


@pytest.mark.slow
def test_non_finite_frames_are_not_shown_but_counted_without_the_watch(
    model: LatentModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = LatentModel(without_continuation(model.checkpoint))  # the network itself, at all times
    outcomes = _outcomes(model, _some_cases(model))
    assert all(outcome.non_finite == 0 for outcome in outcomes)
    # motions that nothing else stops before
    cases = [c for c, outcome in zip(_some_cases(model), outcomes, strict=True) if "stopped" not in outcome.status]
    assert len(cases) > 1
    sound = SolvedTrajectory.reduced

    def broken(self: SolvedTrajectory, times: np.ndarray) -> np.ndarray:
        return sound(self, times) * np.where(times > 1.02, np.nan, 1.0)[:, None]

    monkeypatch.setattr(SolvedTrajectory, "reduced", broken)
    outcomes = _outcomes(model, cases)
    assert [outcome.non_finite for outcome in outcomes] == [0] * len(cases)
    assert all("stopped: it is not finite" in outcome.status for outcome in outcomes)
    monkeypatch.setattr(ReducedMotion, "_make_check", lambda _: None)
    assert [outcome.non_finite for outcome in _outcomes(model, cases)] == [3] * len(cases)


def test_faults_are_outcomes(model: LatentModel, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(LatentModel, "trajectory", broken)
    assert {outcome.status for outcome in _outcomes(model, _some_cases(model))} == {"fault: ZeroDivisionError"}


def test_results_that_depend_on_the_query_are_found(model: LatentModel, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(consistency, "SAMPLES", 1)
    sound, asked = ReducedMotion.vertices, itertools.count()

    def broken(self: ReducedMotion, t: Any) -> Any:
        return sound(self, t) + np.float32(1e-5 * next(asked))

    monkeypatch.setattr(ReducedMotion, "vertices", broken)
    failed = {name for name, check in consistency.check_consistency(model).items() if not check.holds}
    assert failed >= {"grid_invariance_m", "scrub_order_m", "determinism_m", "batch_invariance_m"}


def test_exaggerated_deformations_are_found(model: LatentModel, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(physics, "SAMPLES", 1)
    arrays = model.checkpoint.arrays
    values = {"basis.values": 50.0 * arrays["basis.values"]}
    wild = LatentModel(replace(model.checkpoint, arrays={**arrays, **values}))
    failed = [{n for n, c in physics.check_physics(m).items() if not c.holds} for m in (model, wild)]
    assert failed[1] - failed[0] >= {"inverted_faces", "edge_strain", "volume_drift"}


@pytest.mark.parametrize(("restitution", "gained"), [(0.8, 0.0), (1.0, 0.0), (1.1, 0.21), (1.4, 0.96)])
def test_energy_gained_by_a_bounce(restitution: float, gained: float) -> None:
    """A point mass is dropped and leaves the floor with `restitution` times the speed it had."""
    times, drop, gravity = np.linspace(0.0, 0.6, 601), 0.5, 9.81
    landing = math.sqrt(2.0 * drop / gravity)
    after = np.maximum(times - landing, 0.0)
    bounce = restitution * gravity * landing * after - 0.5 * gravity * after**2
    poses = np.tile(np.eye(4), (len(times), 1, 1))
    poses[:, 2, 3] = np.where(times < landing, -0.5 * gravity * times**2, bounce - drop)
    gain = energy_gained(times, poses, np.array([[0.0, 0.0, drop]]), np.ones(1))
    assert gain == pytest.approx(gained, abs=0.02)


def test_spin_is_energy() -> None:
    """Two halves of a shell at 0.1 m, at rest and then turning: 1/2 (2/3 r^2) w^2 joins the energy of the fall."""
    times = np.linspace(0.0, 1.0, 1001)
    angle = 30.0 * np.maximum(times - 0.5, 0.0)
    poses = np.stack([np.eye(4)] * len(times))
    poses[:, :3, :3] = rotation_from_vector(angle[:, None] * np.array([0.0, 0.0, 1.0]))
    poses[:, 2, 3] = -0.5 * 9.81 * np.minimum(times, 0.2) ** 2
    points, shares = np.array([[0.1, 0.0, 1.0], [-0.1, 0.0, 1.0]]), np.array([0.5, 0.5])
    # the first tenth: all of the potential energy over the lowest point
    potential = 0.5 * 9.81**2 * 0.2**2
    assert energy_gained(times, poses, points, shares) == pytest.approx(3.0 / potential - 1.0, abs=0.01)


def test_a_map_without_time_is_the_coarsest_and_the_same(model: LatentModel) -> None:
    fractions: list[float] = []
    found = refined_map(model, 0.0, scale=1.0, moments=(0.5, 1.0), report=fractions.append)
    assert found.solved == 9
    assert len(fractions) == 9
    known = stability_map(model, scale=1.0, count=3, moments=(0.5, 1.0))
    assert np.allclose(found.values * found.largest, known.values * known.largest)
    assert np.array_equal(found.sound, known.sound)
    finer = refined_map(model, 60.0, scale=1.0, moments=(0.5, 1.0))
    assert finer.solved == 17 * 17
    assert np.allclose(finer.values[:, ::8, ::8] * finer.largest, found.values * found.largest)


def test_the_plot_shows_where_and_when_a_model_is_unstable(model: LatentModel, monkeypatch: pytest.MonkeyPatch) -> None:
    plot = stability_map(model, ("force", "mass"), scale=1.0, count=3, moments=(0.5, 1.0, 10.0))
    assert plot.names == ("force", "mass")
    assert plot.values.shape == plot.sound.shape == (3, 3, 3)
    force, mass = (next(p for p in model.schema.parameters if p.name == name) for name in plot.names)
    motion = model.solve(None, {"force": force.denormalise(1.0), "mass": mass.denormalise(-1.0)})
    shares = motion.deformation_rms(plot.times) / plot.values[:, 0, 2]
    assert np.allclose(shares, shares[0])
    for i, mass_at in enumerate(plot.units):
        for j, force_at in enumerate(plot.units):
            one = model.solve(None, {"force": force.denormalise(force_at), "mass": mass.denormalise(mass_at)})
            sound = [one.stop_at(time) is None for time in plot.times.tolist()]
            assert plot.sound[:, i, j].tolist() == sound
    picture = np.asarray(map_image(plot))
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 5
    monkeypatch.setattr(SolvedTrajectory, "last_good", property(lambda _: 0.9))
    failed = stability_map(model, scale=1.0, count=3, moments=(0.5, 1.0, 10.0))
    assert failed.sound[:2].any()
    assert not failed.sound[2].any()
    assert not np.array_equal(picture, np.asarray(map_image(failed)))
