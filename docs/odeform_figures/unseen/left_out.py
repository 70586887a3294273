"""One object left out: its own test motions as those of an unseen shape, moved as the most similar other object."""

from dataclasses import replace

from odeform.dataset.index import Dataset
from odeform.models.modal.model import ModalModel
from odeform.models.per_object import PerObject
from odeform.schema import OBJECT
from odeform.simulation.objects.canonical import distances_to
from odeform.simulation.objects.catalog import get_object
from odeform.types import MotionSequence
from odeform_figures.unseen.shapes import LEFT_OUT, UnseenShape

__all__ = ["left_out_shape", "without"]

MOTIONS = 20  # of an object


def without(trained: PerObject, name: str) -> PerObject:
    """Returns the model as if it had been trained without an object: each is trained by itself."""
    checkpoint = trained.checkpoint
    config = {**checkpoint.config, "objects": {k: v for k, v in checkpoint.config["objects"].items() if k != name}}
    schema = replace(checkpoint.schema, objects=tuple(other for other in checkpoint.schema.objects if other != name))
    return PerObject(replace(checkpoint, schema=schema, config=config), ModalModel)


def left_out_shape(dataset: Dataset, name: str, trained: PerObject) -> UnseenShape:
    """Returns an object with its first test motions at the window's rate, like the most similar of the objects of
    `trained`."""
    window = dataset.schema.window
    item = get_object(name)
    recorded = (
        dataset.read(entry).frames(window.stop, window.rate) for entry in dataset.select("test", name)[:MOTIONS]
    )
    motions = tuple(_without_object(motion) for motion in recorded)
    away = distances_to(item.rest_mesh().points, tuple(trained.parts))
    return UnseenShape(name, LEFT_OUT, min(away, key=lambda other: away[other]), item, motions)


def _without_object(motion: MotionSequence) -> MotionSequence:
    given = {key: value for key, value in motion.parameters.items() if key != OBJECT}
    return replace(motion, parameters=given)
