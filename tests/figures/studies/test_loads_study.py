"""How long new motions under loads take."""

from odeform_figures.studies.loads import timed


def test_times_are_of_each_object_and_relative_to_a_throw() -> None:
    found = timed("contact-force", ["chip", "donut"], 1, ["throw", "kick"])
    assert found["throw"]["of_a_throw"] == 1.0
    for row in found.values():
        assert set(row["of_objects"]) == {"chip", "donut"}
        assert 0.0 < min(row["of_objects"].values()) <= row["ms"] <= max(row["of_objects"].values())
    assert "of_a_throw" not in timed("contact-force", ["chip"], 1, ["kick"])["kick"]
