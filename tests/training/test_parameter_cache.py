"""Finished contact parameters of an interrupted training."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from odeform.dataset.index import Dataset, Entry
from odeform.errors import InputError
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.models.modal.training.parameter_cache import SHARED, ParameterCache
from odeform.simulation.scenes.contact_force import SCENE

ENTRIES = (Entry("one", "train", {"object": "cat"}, "a"), Entry("two", "test", {"object": "cat"}, "b"))
DATA = Dataset(Path("pushes"), SCENE.schema, ENTRIES, lambda entry: None, {})  # pyright: ignore[reportArgumentType]
PARAMETERS = ContactParameters(floor_friction=0.7)


def test_laws_are_known_again(tmp_path: Path) -> None:
    known_parameters = ParameterCache(tmp_path / "part", DATA, 0)
    assert known_parameters.get(SHARED) is None
    known_parameters.add(SHARED, ContactParameters())
    known_parameters.add("cat", PARAMETERS)
    again = ParameterCache(tmp_path / "part", DATA, 0, resume=True)
    assert again.get("cat") == PARAMETERS
    assert again.get(SHARED) == ContactParameters()
    assert again.get("dog") is None
    # a training that starts over knows none
    assert ParameterCache(tmp_path / "part", DATA, 0).get("cat") is None


def test_those_of_another_training_are_refused(tmp_path: Path) -> None:
    ParameterCache(tmp_path / "part", DATA, 0).add("cat", PARAMETERS)
    window = replace(SCENE.schema, window=replace(SCENE.schema.window, stop=0.1))
    others = (replace(DATA, entries=(replace(ENTRIES[0], sha256="c"),)), replace(DATA, schema=window))
    for data, seed in ((DATA, 1), *((other, 0) for other in others)):
        with pytest.raises(InputError, match="state of another training"):
            ParameterCache(tmp_path / "part", data, seed, resume=True)
    # test motions do not decide anything
    assert (
        ParameterCache(tmp_path / "part", replace(DATA, entries=ENTRIES[:1]), 0, resume=True).get("cat") == PARAMETERS
    )


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"training": {}, "laws": {"cat": {"gravity": 1}}}', '{"training": 1, "laws": [1]}']
)
def test_damaged_states_are_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "part").write_text(text)
    with pytest.raises(InputError):
        ParameterCache(tmp_path / "part", DATA, 0, resume=True)
    with pytest.raises(InputError, match="expected an interrupted training"):
        ParameterCache(tmp_path / "none", DATA, 0, resume=True)


def test_numbers_that_are_none_are_refused(tmp_path: Path) -> None:
    known_parameters = ParameterCache(tmp_path / "part", DATA, 0)
    known_parameters.add("cat", PARAMETERS)
    saved = json.loads((tmp_path / "part").read_text())
    saved["laws"]["cat"]["stiffness"] = "soft"
    (tmp_path / "part").write_text(json.dumps(saved))
    with pytest.raises(InputError, match="not a state"):
        ParameterCache(tmp_path / "part", DATA, 0, resume=True)
