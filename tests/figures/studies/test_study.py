"""The study's figures, by hand on made-up motions."""

import numpy as np
import pytest

from odeform.types import Floats, MotionSequence
from odeform_figures.studies.measurements import contacts, rebound
from odeform_figures.studies.study import RATE, _condition, _rmse, main


def bobbing(*heights: float, weights: tuple[float, ...] = (0.5, 0.5), above: float = 0.0) -> MotionSequence:
    """Two vertices, the second `above` metres over the first, whose height in millimetres is given by frame."""
    vertices = np.zeros((len(heights), 2, 3), dtype=np.float32)
    vertices[:, :, 2] = 1e-3 * np.array(heights)[:, None] + [0.0, above]
    return MotionSequence(np.arange(len(heights)) / RATE, vertices, np.array([[0, 1, 0]]), np.array(weights))


def moved(vertices: Floats) -> MotionSequence:
    count = vertices.shape[1]
    return MotionSequence(np.arange(len(vertices)) / RATE, vertices, np.array([[0, 0, 0]]), np.full(count, 1.0 / count))


def test_a_command_that_cannot_be_run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    for option in ("--count", "--workers"):
        monkeypatch.setattr("sys.argv", ["study", "kick", option, "0"])
        with pytest.raises(SystemExit):
            main()
        assert f"{option}: expected at least 1, got 0" in capsys.readouterr().err


def test_contacts_are_those_of_the_lowest_vertex() -> None:
    motion = bobbing(0.0, 100.0, 1.9, -1.0, 2.1, 1.0, above=0.2)
    assert contacts(motion) == [slice(0, 1), slice(2, 4), slice(5, 6)]
    assert contacts(bobbing(50.0, 40.0, 30.0)) == []


def test_rebound_of_a_drop_is_above_where_it_comes_to_rest() -> None:
    motion = bobbing(500.0, 200.0, 0.0, 120.0, 300.0, 90.0, 0.0, 40.0, 0.0, above=0.2)
    assert rebound(motion) == pytest.approx(0.3)


def test_rebound_of_a_kick_is_after_its_first_landing() -> None:
    """It starts on the floor, which is no landing."""
    assert rebound(bobbing(0.0, 1.0, 400.0, 0.0, 60.0, 0.0)) == pytest.approx(0.06)
    # and need not have come down again when the window ends
    assert rebound(bobbing(0.0, 1.0, 400.0, 0.0, 60.0, 50.0)) == pytest.approx(0.06)


def test_rebound_is_that_of_the_centre_of_mass() -> None:
    motion = bobbing(100.0, 0.0, 0.0, 0.0, weights=(0.25, 0.75))
    motion.vertices[2, 1, 2] = 0.08
    assert rebound(motion) == pytest.approx(0.75 * 0.08)


def test_no_rebound_without_a_landing() -> None:
    assert rebound(bobbing(0.0, 1.0, 400.0, 500.0)) is None


def test_rmse_is_over_coordinates() -> None:
    a, b = bobbing(0.0, 5.0, 9.0), bobbing(0.0, 5.0, 9.0)
    b.vertices[:, 0, 0] += 0.006
    assert _rmse(a, b) == pytest.approx(0.006 / np.sqrt(6.0), rel=1e-5)


def test_rmse_holds_what_ended_first() -> None:
    short, long = bobbing(8.0, 4.0, 0.0), bobbing(8.0, 4.0, 0.0, 0.0, 0.0)
    assert _rmse(long, short) == _rmse(short, long) == 0.0
    short.vertices[-1, :, 1] = 0.003
    # wrong in three of five frames by 3 mm along one of three axes
    assert _rmse(long, short) == pytest.approx(0.003 * np.sqrt(3.0 / 15.0), rel=1e-5)


def test_condition_is_the_ratio_of_the_marks_that_two_parameters_leave() -> None:
    still = np.zeros((6, 3, 3))

    def nudged(vertex: int, axis: int, by: float, later: float = 0.0) -> list[MotionSequence]:
        pair = []
        for sign in (-1.0, 1.0):
            vertices = still.copy()
            vertices[2:4, vertex, axis] = sign * by
            vertices[4:] = sign * later
            pair.append(moved(vertices))
        return pair

    contact = slice(2, 4)
    assert _condition(contact, nudged(0, 2, 4.0) + nudged(1, 0, 1.0)) == pytest.approx(4.0)
    # what comes after the contact has no part in it
    assert _condition(contact, nudged(0, 2, 4.0, later=9.0) + nudged(1, 0, 1.0, later=9.0)) == pytest.approx(4.0)
    # the same mark twice: nobody can tell the parameters apart
    assert _condition(contact, nudged(0, 2, 4.0) + nudged(0, 2, 1.0)) > 1e9
