"""All models by name (`odeform.models.names`), and how one is loaded from a checkpoint."""

import importlib
from pathlib import Path
from typing import TypeVar

from odeform.checkpoint import Checkpoint, read_checkpoint, resolve_checkpoint
from odeform.errors import InputError
from odeform.loads.registry import PUSH, get_load, split_load
from odeform.models.authors.file import ENDING, read_authors_checkpoint
from odeform.models.base import Predictor
from odeform.models.names import ALIASES, MODELS, TRAINABLE
from odeform.models.per_object import PerObject, is_per_object
from odeform.models.plugins import plugged_in, registered
from odeform.models.reduced_model import ReducedModel
from odeform.schema import Schema
from odeform.types import MotionSequence

__all__ = [
    "MODELS",
    "TRAINABLE",
    "load",
    "load_continuous",
    "load_model",
    "load_reduced",
    "model_class",
    "observations",
    "open_checkpoint",
]

Kind = TypeVar("Kind", bound=Predictor)


def model_class(name: str) -> type[Predictor]:
    """Returns the class of a model, or of an alias of one; `InputError` for any other name.

    Besides those of this package there are models that a program registered (`odeform.models.plugins`), and those that
    installed packages declare. No code is imported because a checkpoint names it.
    """
    known = ALIASES.get(name, name)
    if known in MODELS:
        module, _, attribute = MODELS[known].partition(":")
        return getattr(importlib.import_module(module), attribute)
    found = plugged_in(known)
    if found is None:
        names = ", ".join((*MODELS, *registered()))
        raise InputError(f"unknown model {name!r}: expected one of {names}; a file of your own is named by --plugin")
    return found


def open_checkpoint(name: str | Path) -> Checkpoint:
    """Opens a checkpoint file of ODeform, a `.pth` of the paper's authors, or a bundled checkpoint by its name SCENE
    or SCENE/MODEL; of a mechanical model also NAME:LOAD, its bodies under another load. `InputError` for anything
    else."""
    path, (_, load) = resolve_checkpoint(str(name)), split_load(str(name))
    if path.suffix.lower() == ENDING:
        return read_authors_checkpoint(path)
    checkpoint = read_checkpoint(path)
    return checkpoint if load == PUSH else model_class(checkpoint.model).under_load(checkpoint, get_load(load))


def load(name: str | Path) -> Predictor:
    """Load a predictor.

    Args:
        name: Path of a checkpoint (`.safetensors`, or `.pth` of the paper's authors), or name of a bundled one: SCENE,
            which is its own ODeform model, or SCENE/MODEL. NAME:LOAD are the bodies of a mechanical model under
            another load, as `Predictor.under` has them.

    Raises:
        InputError: Not a checkpoint, or one of an unknown model.

    Examples:
        >>> import odeform
        >>> odeform.load("kick").model
        'rolling'
        >>> odeform.load("mass-elastic/pod-rbf").model
        'pod-rbf'
        >>> odeform.load("contact-force:drop").schema.scene
        'object-drop'
    """
    base, wanted = split_load(str(name))
    checkpoint = open_checkpoint(base)
    try:
        model_class(checkpoint.model)
    except InputError as error:
        raise InputError(f"checkpoint {name}: {error}") from None
    predictor = load_model(checkpoint)
    # by `under`, so that it can be brought under other loads, the push among them
    return predictor if wanted == PUSH else predictor.under(wanted)


def load_model(checkpoint: Checkpoint) -> Predictor:
    """The predictor of a checkpoint that is read already."""
    model = model_class(checkpoint.model)
    return PerObject(checkpoint, model) if is_per_object(checkpoint) else model(checkpoint)


def load_continuous(name: str | Path) -> Predictor:
    """Loads as `load` does; `InputError` for a network that only knows its training frames."""
    predictor = load(name)
    if not predictor.extrapolates:
        raise InputError(
            f"checkpoint {name}: {predictor.model} is tied to its training frames; expected an ODeform checkpoint"
        )
    return predictor


def load_reduced(name: str | Path) -> ReducedModel:
    """Loads as `load` does; `InputError` for a model that is not of reduced coordinates."""
    predictor = load(name)
    if not isinstance(predictor, ReducedModel):
        raise InputError(f"checkpoint {name}: expected a model of reduced coordinates, got {predictor.model}")
    return predictor


def observations(schema: Schema, record: MotionSequence) -> MotionSequence | None:
    """The frames of a recording that a model of this schema is given, at its window's rate; None for most models."""
    if not schema.needs_observations:
        return None
    step = float(record.times[1] - record.times[0])
    return record.until(schema.window.stop, max(round(1.0 / (schema.window.rate * step)), 1))
