"""Contacts and forces that are not given."""

from typing import Any

import numpy as np
import pytest

from odeform.geometry.contact import checked_contact
from odeform.simulation.contacts import complete_push, contact_parameters, push_from, vector_of
from odeform.simulation.objects.catalog import OBJECTS, get_object
from odeform.simulation.scenes.contact_force import SCENE
from odeform.types import Mesh


def completed(given: dict[str, Any], rest: Mesh) -> dict[str, Any]:
    assert SCENE.contacts is not None
    return complete_push(given, rest, SCENE.contacts.forces_on(given["object"]))


@pytest.mark.parametrize("name", OBJECTS)
def test_every_object_has_a_push_of_its_own(name: str) -> None:
    rest = get_object(name).rest_mesh()
    filled = completed({"object": name}, rest)
    contact, _ = checked_contact(rest, vector_of(filled, "contact"), vector_of(filled, "force"))
    assert contact.distance < 1e-6
    weakest, strongest = get_object(name).forces
    assert weakest < np.linalg.norm(vector_of(filled, "force")) < strongest


def test_what_is_given_stays() -> None:
    rest = get_object("donut").rest_mesh()
    top = rest.points[rest.points[:, 2].argmax()].astype(float)
    given = {"object": "donut", **{f"contact_{a}": float(x) for a, x in zip("xyz", top, strict=True)}}
    filled = completed(given, rest)
    assert given.items() <= filled.items()
    assert filled["force_z"] < 0.0, "the force pushes into the surface at the contact"
    down = completed({"object": "donut", "force_x": 0.0, "force_y": 0.0, "force_z": -2.0}, rest)
    assert push_from(down, rest).contact.normal[2] > 0.9
    assert completed({"object": "donut", "force_x": "strong"}, rest)["force_x"] == "strong"


def test_a_push_and_its_parameters_are_the_same() -> None:
    rest = get_object("pillow").rest_mesh()
    filled = completed({"object": "pillow"}, rest)
    again = contact_parameters(push_from(filled, rest))
    assert {name: filled[name] for name in again} == pytest.approx(again)
