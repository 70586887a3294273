"""One object left out: the contact parameters fitted to the others, and the object's own test motions as those of an
unseen shape."""

from collections.abc import Callable
from dataclasses import asdict, replace

import numpy as np

from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.models.modal.model import ModalModel
from odeform.models.modal.training.contact_fit import fit_contact_parameters
from odeform.models.modal.training.fit import SEQUENCES
from odeform.models.modal.training.pushes import read_pushes
from odeform.models.per_object import PerObject
from odeform.schema import OBJECT
from odeform.simulation.objects.canonical import distances_to
from odeform.simulation.objects.catalog import get_object
from odeform.types import MotionSequence
from odeform_figures.unseen.shapes import LEFT_OUT, UnseenShape

__all__ = ["contact_parameters_without", "left_out_shape", "without"]

MOTIONS = 20  # of an object
EVALUATIONS = 2  # of the errors and their derivatives


def contact_parameters_without(
    trained: PerObject, dataset: Dataset, name: str, report: Callable[[str], None]
) -> ContactParameters:
    """One set of contact parameters fitted to training motions of all objects but `name`, as `odeform train` fits it to
    all.

    It starts from the median of the others' own contact parameters, so that few evaluations suffice.
    """
    bodies, known_parameters = [], []
    for other, part in trained.parts.items():
        if other != name and isinstance(part, ModalModel):
            known_parameters.append(list(asdict(part.contact_parameters).values()))
            entries = dataset.select("train", other)
            kept = np.random.default_rng(0).permutation(len(entries))[:SEQUENCES]
            few = replace(dataset, entries=tuple(entries[at] for at in kept)).of(other)
            bodies.append(read_pushes(few, "train", part.body))
    if not bodies:
        raise InputError(f"expected a model of several objects, got one of {', '.join(trained.parts)}")
    start = ContactParameters(*np.exp(np.median(np.log(known_parameters), axis=0)).tolist())
    return fit_contact_parameters(bodies, dataset.fixed["pulse_s"], start, report=report, evaluations=EVALUATIONS)


def without(trained: PerObject, name: str, contact_parameters: ContactParameters) -> PerObject:
    """Returns the model as if it had been trained without an object: the others, all with these
    `contact_parameters`."""
    checkpoint = trained.checkpoint
    parts = {other: part for other, part in checkpoint.config["objects"].items() if other != name}
    config = {
        **checkpoint.config,
        "objects": {other: {**part, "law": contact_parameters.to_json()} for other, part in parts.items()},
    }
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
