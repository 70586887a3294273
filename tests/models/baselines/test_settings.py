"""What stands in a checkpoint of a baseline is checked when it is read, or at the latest when it is used."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from odeform.errors import InputError
from odeform.models.registry import model_class, open_checkpoint

FRAME = {"anchor": [0.0, 0.0, 0.1], "arm": 0.1, "reach": 0.2, "largest": 1.0, "scale": 0.1, "part_scale": 0.1}


@pytest.mark.parametrize(
    ("model", "settings"),
    [
        ("gp", {"length_scales": [0.0, 1.0]}),
        ("gp", {"length_scales": 1.0}),
        ("gp", {"length_scales": [1.0, 1.0, 1.0]}),
        ("gp", {"order": 3}),
        ("gp", {"length_scales": [float("nan"), 1.0]}),
        ("pod-rbf", {"smoothing": float("nan")}),
        ("pod-rbf", {"smoothing": -1.0}),
        ("direct", {"frame": {}}),
        ("direct", {"frame": {**FRAME, "anchor": []}}),
        ("direct", {"frame": {**FRAME, "arm": 0.0}}),
        ("direct", {"frame": {**FRAME, "scale": ""}}),
        ("direct", {"frame": {**FRAME, "reach": float("inf")}}),
    ],
)
def test_wrong_settings_are_refused_when_read(model: str, settings: dict[str, Any]) -> None:
    checkpoint = open_checkpoint(f"mass-elastic/{model}")
    model_class(model)(checkpoint)
    with pytest.raises(InputError, match=f"checkpoint of {model}: missing or wrong"):
        model_class(model)(replace(checkpoint, config={**checkpoint.config, **settings}))


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("model", ["gp", "pod-rbf"])
def test_predictions_that_are_not_finite_are_refused(model: str, value: float) -> None:
    checkpoint = open_checkpoint(f"mass-elastic/{model}")
    arrays = {**checkpoint.arrays, "pod.modes": np.full_like(checkpoint.arrays["pod.modes"], value)}
    predictor = model_class(model)(replace(checkpoint, arrays=arrays))
    with pytest.raises(InputError, match="the checkpoint predicts numbers that are not finite"):
        predictor.solve()


@pytest.mark.parametrize("model", ["gp", "pod-rbf"])
def test_inputs_are_the_parameters_of_the_scene(model: str) -> None:
    checkpoint = open_checkpoint(f"mass-elastic/{model}")
    arrays = {**checkpoint.arrays, "theta": checkpoint.arrays["theta"][:, :1]}
    with pytest.raises(InputError, match=r"theta: expected shape \(S, 2\)"):
        model_class(model)(replace(checkpoint, arrays=arrays))


@pytest.mark.parametrize(("name", "change"), [("times", np.flip), ("shifts", lambda shifts: np.nan * shifts)])
def test_the_mean_motion_has_times_that_increase(name: str, change: Callable[[np.ndarray], np.ndarray]) -> None:
    checkpoint = open_checkpoint("mass-elastic/direct")
    arrays = {**checkpoint.arrays, f"mean.{name}": change(checkpoint.arrays[f"mean.{name}"])}
    with pytest.raises(InputError, match="mean: expected times that increase"):
        model_class("direct")(replace(checkpoint, arrays=arrays))


def test_the_anchor_is_a_point() -> None:
    checkpoint = open_checkpoint("mass-elastic/pod-rbf")
    space = {**checkpoint.config["space"], "anchor": 0.1}
    with pytest.raises(InputError, match="anchor: expected three numbers"):
        model_class("pod-rbf")(replace(checkpoint, config={**checkpoint.config, "space": space})).solve()


@pytest.mark.parametrize("clock", [0.0, -1.0, float("nan")])
def test_the_clock_of_decoders_is_a_time(clock: object) -> None:
    checkpoint = open_checkpoint("mass-elastic/odeform")
    network = {**checkpoint.config["network"], "clock": clock}
    with pytest.raises(InputError, match="clock: expected a positive number"):
        model_class("odeform")(replace(checkpoint, config={**checkpoint.config, "network": network}))
