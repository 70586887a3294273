"""Motions outside of the trained ranges, beside simulations."""

from pathlib import Path

import numpy as np
import pytest

from odeform.models.error_band import OUTSIDE, STRONGER
from odeform.models.registry import load
from odeform_figures.studies.outside import FIT, TEST, Outside, compared, fitted, outside, summary

SCHEMA = load("mass-elastic").schema


def test_one_parameter_is_outside_at_sides_and_all_at_corners() -> None:
    for seed in (FIT, TEST):
        rows = outside(SCHEMA, 0.1, seed)
        assert [len(SCHEMA.outside(parameters)) for _, parameters in rows] == [1, 1, 1, 1, 2, 2, 2, 2]
    assert dict(rows)["mass -"]["mass"] == pytest.approx(0.9 * 0.2)
    assert dict(rows)["corner +-"] == pytest.approx({"mass": 1.1, "bending": 0.27})
    assert outside(SCHEMA, 0.1, TEST) == rows


def test_bodies_are_pushed_by_more_than_the_strongest_force() -> None:
    pushed = load("contact-force")
    rows = outside(pushed.schema, 0.25, TEST)
    assert len(rows) == 3 * 7
    for _, parameters in rows:
        force = np.linalg.norm([parameters[f"force_{axis}"] for axis in "xyz"])
        assert force == pytest.approx(1.25 * pushed.force_range({"object": parameters["object"]})[1])


def test_a_band_that_is_fitted_to_errors_covers_them(tmp_path: Path) -> None:
    """Truths that a model misses by more the farther they are outside, and the later."""
    model, times = load("mass-elastic/nearest"), SCHEMA.window.times
    for seed in (FIT, TEST):
        for share in (0.1, 0.25):
            for name, parameters in outside(SCHEMA, share, seed):
                truth = model.solve(parameters=parameters).vertices(times) + 0.1 * share * times[:, None, None]
                np.save(tmp_path / f"mass-elastic-{seed}-{share:g}-{name}.npy", truth)
    before = compared(model, FIT, 1, tmp_path)
    again = fitted(model, [motion for motions in before.values() for motion in motions])
    assert again.checkpoint.arrays[OUTSIDE].shape == (2, 2)
    assert (again.checkpoint.arrays[OUTSIDE] >= 0.0).all()
    found = summary(compared(again, TEST, 1, tmp_path)[0.25])
    assert found["covered_frames"] > 0.7
    assert found["sides_mm"] > 0.0
    assert len(found["motions"]) == 8


def test_bands_of_pushes_widen_as_much_as_errors_of_stronger_ones_need() -> None:
    """Errors that double where the force is a quarter beyond the strongest."""
    pushed, motions = load("contact-force"), []
    times = pushed.schema.window.times
    for share in (0.1, 0.25):
        for name, parameters in outside(pushed.schema, share, FIT):
            complete = pushed.complete(parameters)
            weaker = {k: v / (1.0 + share) if k.startswith("force") else v for k, v in complete.items()}
            band = pushed.error_band(weaker, times)
            assert band is not None
            motions.append(Outside(name, complete, 2.0 ** (share / 0.25) * band[1:, 1], band[1:]))
    again = fitted(pushed, motions)
    growth = [again.checkpoint.arrays[f"{name}/{STRONGER}"] for name in pushed.schema.objects]
    assert growth == pytest.approx([np.log(2.0) / 0.5] * 7, rel=1e-6)
