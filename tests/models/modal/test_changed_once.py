"""A body of another mass and stiffness is made without evaluating its modes again."""

import numpy as np
import pytest

from odeform.models.registry import load
from odeform.motion.basis import DisplacementBasis


def test_modes_are_not_evaluated_again_for_another_mass(monkeypatch: pytest.MonkeyPatch) -> None:
    model = load("contact-force").model_of({"object": "dog"})
    model.solve(parameters={"object": "dog"}).vertices(0.05)
    calls: list[int] = []
    values = DisplacementBasis.values

    def counted(self: DisplacementBasis, points, out=None):
        calls.append(len(points))
        return values(self, points, out)

    monkeypatch.setattr(DisplacementBasis, "values", counted)
    moved = [
        model.solve(parameters={"object": "dog", "mass": mass, "young": young}).vertices(0.05)
        for mass, young in ((1.5, 90.0), (1.55, 90.0), (1.55, 91.0))
    ]
    assert not calls
    assert np.abs(moved[1] - moved[0]).max() > 1e-6  # m
    coordinates = {id(model.changed({"mass": mass}).coordinates) for mass in (1.5, 1.55)}
    assert coordinates == {id(model.coordinates)}
