"""Shapes that were never seen, under loads: what is compared, and how it is written."""

import pytest

from odeform.errors import InputError
from odeform_figures.studies.unseen_loads import compared, makers, table


def row(model: float, rigid: float) -> dict[str, object]:
    errors = {"place_mm": 12.4, "turn_deg": 3.6}
    return {
        "like": "dog",
        "motions": 3,
        "model": {"first_120_ms": model, "whole": 2.0 * model, **errors},
        "rigid": {"first_120_ms": rigid, "whole": 2.0 * rigid, **errors},
    }


def test_shapes_are_compared_with_the_seven_by_their_means() -> None:
    found = compared({"a": row(0.2, 0.6), "b": row(0.4, 0.3)}, {"dog": row(0.1, 0.5), "cat": row(0.3, 0.5)})
    assert found["unseen"]["model"]["first_120_ms"] == pytest.approx(0.3)
    assert found["seven"]["rigid"]["whole"] == pytest.approx(1.0)
    assert found["ratio"] == pytest.approx({"first_120_ms": 1.5, "whole": 1.5})
    assert found["ratio_like"] == pytest.approx({"first_120_ms": 3.0, "whole": 3.0}), "both are like the dog"
    assert found["better_than_rigid"] == 1
    assert found["shapes"] == 2


def test_all_lines_of_the_table_have_all_of_its_cells() -> None:
    shapes = {"a": row(0.2, 0.6), "b": row(0.4, 0.3)}
    means = compared(shapes, {"dog": row(0.3, 0.5)})
    lines = table({"drop": {"shapes": shapes, "means": means}}).splitlines()
    assert len({line.count("|") for line in lines}) == 1
    assert lines[2] == "| drop, a | dog | 3 | 20 % | 60 % | 40 % | 120 % | 12 mm | 4° |"
    assert lines[-2].startswith("| drop, times the seven's | | | 1.00 | | 1.00 |")


def test_instances_that_there_are_not_are_refused() -> None:
    with pytest.raises(InputError, match="dog-huge"):
        makers(["dog-huge"], [])
    assert list(makers(["dog-extreme"], [])) == ["dog-extreme"]
