"""What accuracy costs under loads."""

from odeform_figures.studies.loads_trade import traded


def test_a_smaller_tolerance_is_nearer_to_the_reference() -> None:
    loose, tight = traded("contact-force", "drop", ["donut"], 2, (2e-3, 2e-5))
    assert 0.0 < tight["median"] < 0.3 * loose["median"]
    assert min(tight["ms"], loose["ms"]) > 0.0
    assert loose["median"] <= loose["most"]
