"""Data sets of a user's own shape."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.geometry.contact import nearest_on
from odeform.simulation.contacts import vector_of
from odeform.simulation.objects.catalog import get_object
from odeform.simulation.objects.materials import forces_at
from odeform.simulation.objects.user_object import BODY, UserObject, object_name, read_user_object, write_user_object
from odeform.simulation.scenes.user_object import scene_with
from odeform.simulation.user_data import body_in, digest, simulate_item
from tests.soft_block import block_object

RATE, STEP = 50.0, 1e-3


@pytest.mark.parametrize(
    ("file", "name"),
    [("scans/My Shoe (2).obj", "my-shoe-2"), ("donut.stl", "own-donut"), ("??.ply", "shape"), ("a" * 99, "a" * 40)],
)
def test_a_name_is_that_of_the_file_and_no_trained_object(file: str, name: str) -> None:
    assert object_name(file) == name


def test_a_body_is_read_as_it_was_written(tmp_path: Path) -> None:
    item = block_object()
    write_user_object(tmp_path, UserObject(item, "pillow", "a file"))
    found = read_user_object(tmp_path)
    assert found is not None
    assert (found.like, found.source, found.item.name, found.item.forces) == ("pillow", "a file", "block", (1.0, 4.0))
    assert np.abs(found.item.points - item.points).max() < 1e-7
    assert found.item.material == item.material
    (tmp_path / BODY).write_bytes((tmp_path / BODY).read_bytes()[:500])
    with pytest.raises(InputError, match=r"body\.npz: cannot be read"):
        read_user_object(tmp_path)


def test_pushes_are_drawn_on_the_body_and_within_its_ranges() -> None:
    item = replace(get_object("donut"), name="ring")
    scene = scene_with("contact-force", item)
    rows = scene.sample(50, 0)
    assert {row["object"] for row in rows} == {"ring"}
    assert not any(scene.schema.outside(row) for row in rows)
    strengths = [np.linalg.norm(vector_of(row, "force")) for row in rows]
    assert max(strengths) <= item.forces[1]
    rest = item.rest_mesh()
    for row, strength in zip(rows, strengths, strict=True):
        weakest, strongest = forces_at(item, nearest_on(rest, vector_of(row, "contact")))
        assert weakest - 1e-6 <= strength <= strongest + 1e-6
    assert scene_with("object-drop", item).sample(2, 0)[0]["object"] == "ring"


def test_a_scene_of_one_body_takes_no_shape() -> None:
    with pytest.raises(InputError, match="kick: it has one body of its own"):
        scene_with("kick", block_object())


def test_another_material_has_another_digest() -> None:
    item = block_object()
    stiffer = replace(item, material=replace(item.material, young=2.0 * item.material.young))
    assert digest(item) == digest(block_object("other"))
    assert digest(item) != digest(stiffer)


@pytest.mark.slow
def test_an_interrupted_simulation_goes_on_with_the_same_body(tmp_path: Path) -> None:
    item = block_object("My Block")
    whole = simulate_item("contact-force", item, "pillow", tmp_path / "whole", count=3, rate=RATE, step=STEP)
    told: list[tuple[int, int]] = []

    def interrupt(done: int, count: int) -> None:
        told.append((done, count))
        if done == 2:
            raise KeyboardInterrupt

    out = tmp_path / "part"
    with pytest.raises(KeyboardInterrupt):
        simulate_item("contact-force", item, "pillow", out, count=3, rate=RATE, step=STEP, report=interrupt)
    assert told == [(0, 3), (1, 3), (2, 3)]
    kept = open_dataset(out)
    assert len(kept.select("all")) == 2
    again = simulate_item("contact-force", item, "pillow", out, count=3, rate=RATE, step=STEP)
    assert again.entries == whole.entries
    assert again.objects == ("my-block",)
    body = body_in(out)
    assert body is not None
    first = again.read(again.entries[0])
    assert np.array_equal(first.vertices[0], body.item.rest_mesh().points)
    assert np.abs(first.vertices - first.vertices[0]).max() > 2e-4, "it was pushed"


@pytest.mark.slow
def test_motions_of_another_body_are_not_mixed_in(tmp_path: Path) -> None:
    item = block_object()
    simulate_item("contact-force", item, "pillow", tmp_path, count=1, rate=RATE, step=STEP)
    heavier = replace(item, material=replace(item.material, density=500.0))
    with pytest.raises(InputError, match="holds motions of block from another file or of another material"):
        simulate_item("contact-force", heavier, "pillow", tmp_path, count=1, rate=RATE, step=STEP)
    index = json.loads((tmp_path / "dataset.json").read_text())
    assert index["schema"]["objects"] == ["block"]
