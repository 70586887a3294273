"""The state of an interrupted training in a file, with what must be the same for it to be continued."""

import io
import json
import pickle
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch

from odeform.errors import InputError
from odeform.io import atomic_write

__all__ = ["read_part", "write_part"]

DAMAGED = (pickle.UnpicklingError, zipfile.BadZipFile, RuntimeError, KeyError, TypeError, ValueError, EOFError)


def write_part(path: Path, training: Mapping[str, Any], state: Mapping[str, Any]) -> None:
    """Write the state of a training, tensors and plain values in dictionaries and lists; `training` describes it."""
    buffer = io.BytesIO()
    torch.save({"training": json.dumps(training), "state": dict(state)}, buffer)
    atomic_write(path, buffer.getvalue())


def read_part(path: Path, training: Mapping[str, Any]) -> dict[str, Any]:
    """The state that `write_part` wrote; nothing is unpickled but tensors and plain values.

    `InputError` for a file that is missing, damaged, or of another training.
    """
    try:
        known = torch.load(path, map_location="cpu", weights_only=True)
        found, state = json.loads(known["training"]), dict(known["state"])
    except OSError as error:
        raise InputError(f"--resume: {path}: {error.strerror}; expected an interrupted training") from None
    except DAMAGED as error:
        raise InputError(f"--resume: {path}: not a state of a training: {error}") from None
    expected = json.loads(json.dumps(training))
    if found != expected:
        raise InputError(f"--resume: {path}: state of another training: expected {expected}, got {found}")
    return state
