"""What the time of a new push consists of."""

from odeform.dataset.store import open_dataset
from odeform.models.per_object import PerObject
from odeform.models.registry import load
from odeform_figures.speed.phases import PHASES, phases


def test_phases_are_those_of_new_pushes_at_a_quality() -> None:
    predictor = load("contact-force")
    assert isinstance(predictor, PerObject)
    truths = list(open_dataset("contact-force").sequences("test", "chip"))[:2]
    found = {quality: phases(predictor, truths, quality, 1) for quality in ("draft", "reference")}
    for row in found.values():
        assert set(row) == {*PHASES, "number_of_steps"}
        assert min(row.values()) > 0.0
    draft, reference = found["draft"], found["reference"]
    assert reference["number_of_steps"] > 5.0 * draft["number_of_steps"]
    assert reference["steps"] > draft["steps"]
