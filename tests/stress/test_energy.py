"""Floor, obstacles and springs take energy from a body that begins in the air, and give it none."""

from dataclasses import replace

import numpy as np
import pytest

import odeform
from odeform.models.modal import energy_bound
from odeform.models.modal.model import ModalModel
from odeform.stress.energy import energy_gained

TIMES = np.arange(0.0, 0.8, 0.01)


@pytest.fixture(scope="module")
def thrown() -> ModalModel:
    found = odeform.load("contact-force:throw").model_of({"object": "donut"})
    assert isinstance(found, ModalModel)
    return found


def gained(model: ModalModel, **parameters: float) -> float:
    motion = model.solve(parameters={"height": 0.3, "velocity_x": 1.5, "spin_y": 8.0, **parameters})
    assert model.load is not None
    flight = model.load.situation(model.rest, motion.parameters).flight
    assert flight is not None
    return energy_gained(model, motion, flight, TIMES)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_a_throw_gains_none(thrown: ModalModel, ratio: float) -> None:
    assert gained(thrown, mass=ratio * thrown.body.solid.mass, spin_x=5.0) < 1e-3


def test_a_floor_that_drives_is_found(thrown: ModalModel, monkeypatch: pytest.MonkeyPatch) -> None:
    law = thrown.contact_parameters
    driving = thrown.with_contact_parameters(replace(law, floor_damping=-4e-3, damping=0.01))
    assert gained(driving) == 0.0, "it ends before"
    monkeypatch.setattr(energy_bound, "MOST", np.inf)
    assert gained(driving) > 0.05


def test_the_energy_at_the_start_is_that_of_the_flight(thrown: ModalModel) -> None:
    """Less is there at the start than the motion has: with its spin left out, the rest of it counts as gained."""
    motion = thrown.solve(parameters={"height": 0.3, "velocity_x": 0.0, "spin_y": 0.0, "spin_z": 30.0})
    assert thrown.load is not None
    flight = thrown.load.situation(thrown.rest, motion.parameters).flight
    assert flight is not None
    assert energy_gained(thrown, motion, flight, TIMES) < 1e-3
    assert energy_gained(thrown, motion, replace(flight, spin=np.zeros(3)), TIMES) > 0.05
