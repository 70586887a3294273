"""Derivatives by parameters and by points at rest, against differences of the same motions."""

from typing import Any

import numpy as np
import pytest
import torch

import odeform
from odeform.errors import InputError
from odeform.models.base import Predictor

pytestmark = pytest.mark.usefixtures("unchecked")  # programs pass what annotations would refuse first
SLOW = ("kick", "mass-elastic/odeform-rolling", "mass-elastic/direct")
CASES = {
    "mass-elastic": ({"mass": 0.25, "bending": 1.3}, 1e-5),
    "mass-elastic/gp": ({"mass": 0.25, "bending": 1.3}, 1e-5),
    "mass-elastic/odeform-rolling": ({"mass": 0.25, "bending": 1.3}, 1e-2),
    "mass-elastic/direct": ({"mass": 0.25, "bending": 1.3}, 1e-2),
    "kick": ({"mass": 0.6, "bending": 1.0, "force": 140.0, "azimuth": 0.3, "elevation": 0.6}, 1e-2),
    "kick/gp": ({"mass": 0.6, "bending": 1.0, "force": 140.0, "azimuth": 0.3, "elevation": 0.6}, 1e-4),
}
"""Parameters, and the relative error that differences of the whole motion may have."""


def few_points(predictor: Predictor) -> torch.Tensor:
    points = predictor.rest.points
    return torch.tensor(points[:: max(len(points) // 7, 1)], dtype=torch.float64)


def tensors(values: dict[str, float]) -> dict[str, torch.Tensor]:
    return {name: torch.tensor(value, dtype=torch.float64, requires_grad=True) for name, value in values.items()}


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow if n in SLOW else ()) for n in CASES])
def test_derivatives_are_those_of_differences(name: str) -> None:
    predictor, (values, allowed) = odeform.load(name), CASES[name]
    stop = predictor.schema.window.stop
    given, rest, times = tensors(values), few_points(predictor).requires_grad_(), np.array([0.1, 0.5, 0.9]) * stop
    points = predictor.torch(given, times, rest)
    weights = torch.randn(points.shape, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    *by_values, by_points = torch.autograd.grad((points * weights).sum(), [*given.values(), rest])

    def total(values: dict[str, float], points: torch.Tensor) -> float:
        return float((predictor.torch(values, times, points.detach()) * weights).sum())

    for p, slope in zip((p for p in predictor.schema.parameters if p.name in values), by_values, strict=True):
        step = 1e-3 * (p.high - p.low)
        ends = [total({**values, p.name: values[p.name] + side * step}, rest) for side in (-1.0, 1.0)]
        size = float(weights.abs().mean() * points.detach().abs().mean() * weights.numel()) / (p.high - p.low)
        assert float(slope) == pytest.approx((ends[1] - ends[0]) / (2.0 * step), rel=allowed, abs=1e-3 * size)
    way = torch.randn(rest.shape, dtype=torch.float64, generator=torch.Generator().manual_seed(1))
    ends = [total(values, rest + side * 1e-3 * way) for side in (-1.0, 1.0)]
    assert float((by_points * way).sum()) == pytest.approx((ends[1] - ends[0]) / 2e-3, rel=1e-3)


@pytest.mark.slow
def test_a_push_is_differentiated_by_its_contact_and_force() -> None:
    predictor, times = odeform.load("contact-force"), [0.1, 0.3]
    known = predictor.complete({"object": "donut"})
    values = {name: np.array([known[f"{name}_{axis}"] for axis in "xyz"]) for name in ("contact", "force")}
    given = {name: torch.tensor(value, requires_grad=True) for name, value in values.items()}
    points = predictor.torch({"object": "donut", **given}, times)
    points[..., 0].mean().backward()
    for name, step in (("contact", 1e-6), ("force", 1e-4)):
        way = np.array([0.6, -0.3, 0.2])
        moved = [{**values, name: values[name] + side * step * way} for side in (-1.0, 1.0)]
        ends = [float(predictor.torch({"object": "donut", **end}, times)[..., 0].mean()) for end in moved]
        slope = given[name].grad
        assert slope is not None
        assert float(slope @ torch.tensor(way)) == pytest.approx((ends[1] - ends[0]) / (2.0 * step), rel=0.02)


def test_torch_finds_no_fault_with_exact_derivatives() -> None:
    predictor = odeform.load("mass-elastic")
    rest = few_points(predictor)[:1].requires_grad_()

    def points(mass: torch.Tensor, bending: torch.Tensor, rest: torch.Tensor) -> torch.Tensor:
        return predictor.torch({"mass": mass, "bending": bending}, [0.4], rest)

    given = [torch.tensor(value, dtype=torch.float64, requires_grad=True) for value in (0.25, 1.3)]
    assert torch.autograd.gradcheck(points, (*given, rest), eps=1e-5, atol=1e-4, rtol=1e-3)


@pytest.mark.parametrize("name", ["mass-elastic", "kick", "mass-elastic/gp", "mass-elastic/direct"])
def test_points_are_those_of_a_motion(name: str) -> None:
    predictor, times = odeform.load(name), np.array([0.0, 0.05, 0.2])
    points = predictor.torch({}, times)
    assert points.dtype == torch.float32
    assert not points.requires_grad
    assert np.abs(points.numpy() - predictor.solve(quality="reference").vertices(times)).max() < 2e-5
    assert torch.equal(predictor.torch({}, 0.2), predictor.torch({}, [0.2])[0])


def test_parameters_that_are_numbers_are_constants_and_precision_is_that_of_the_tensors() -> None:
    predictor = odeform.load("mass-elastic/gp")
    mass = torch.tensor(0.25, requires_grad=True)
    points = predictor.torch({"mass": mass, "bending": 1.3}, [0.1])
    assert points.dtype == torch.float32
    points.sum().backward()
    assert mass.grad is not None
    assert mass.grad.dtype == torch.float32


def test_a_jacobian_is_computed_at_once() -> None:
    """Rows of a Jacobian are products with one matrix, which PyTorch takes together."""
    predictor = odeform.load("mass-elastic")
    mass = torch.tensor([0.25], dtype=torch.float64)

    def heights(mass: torch.Tensor) -> torch.Tensor:
        return predictor.torch({"mass": mass[0]}, [0.1, 0.3])[:, :2, 2].flatten()

    together = torch.autograd.functional.jacobian(heights, mass, vectorize=True)
    assert torch.allclose(together, torch.autograd.functional.jacobian(heights, mass))


@pytest.mark.parametrize(
    ("given", "times", "geometry", "said"),
    [
        ({"mass": torch.ones(2)}, [0.1], None, "mass: expected a tensor of one number"),
        ({"weight": torch.ones(())}, [0.1], None, "unknown parameter 'weight'"),
        ({}, torch.zeros(1, requires_grad=True), None, "times: expected numbers"),
        ({}, [[0.1]], None, "time: expected seconds"),
        ({}, [0.1], torch.zeros(4, 2), "geometry: expected points"),
    ],
)
def test_other_inputs_are_refused(given: dict[str, Any], times: Any, geometry: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        odeform.load("mass-elastic/gp").torch(given, times, geometry)


def test_models_between_given_frames_have_no_gradients() -> None:
    with pytest.raises(InputError, match="occupancy-flow: has no gradients"):
        odeform.load("mass-elastic/occupancy-flow").torch({}, [0.1])
