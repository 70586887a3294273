"""What accuracy costs under loads."""

from dataclasses import replace

from odeform.models.modal.model import QUALITIES
from odeform_figures.studies.loads_trade import traded


def test_a_smaller_tolerance_is_nearer_to_the_reference() -> None:
    sure = replace(QUALITIES["balanced"], tolerance=1e-5)
    loose, tight = traded("contact-force", "drop", ["donut"], 1, (2e-3, 1e-4), sure)
    assert 0.0 < tight["median"] < 0.5 * loose["median"]
    assert min(tight["ms"], loose["ms"]) > 0.0
    assert loose["median"] <= loose["most"]
