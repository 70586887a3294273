"""The body that a checkpoint shows."""

import numpy as np

from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.simulation.scenes.registry import find_scene
from odeform.types import Arrays, Mesh

__all__ = ["body_arrays", "rest_of"]


def rest_of(dataset: Dataset) -> Mesh:
    """The body that viewers show: the scene's fine mesh, or that of the first training sequence for imported data and
    in scenes with objects."""
    scene = find_scene(dataset.schema.scene)
    if scene is not None and not dataset.schema.objects:
        return scene.rest_mesh()
    first = next(dataset.sequences("train"), None)
    if first is None:
        raise InputError(f"{dataset.root}: no sequence in split train")
    return first.rest


def body_arrays(dataset: Dataset) -> Arrays:
    """`rest.points` (N, 3) in metres and `rest.faces` (F, 3), as a checkpoint stores them."""
    rest = rest_of(dataset)
    return {
        "rest.points": np.asarray(rest.points, dtype=np.float32),
        "rest.faces": np.asarray(rest.faces, dtype=np.int32),
    }
