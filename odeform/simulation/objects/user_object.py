"""A soft object of a user's own shape, in a file beside the motions that are simulated of it."""

import json
import re
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.io import atomic_open
from odeform.simulation.objects.catalog import OBJECTS
from odeform.simulation.objects.files import arrays_of, object_of
from odeform.simulation.objects.soft_object import SoftObject

__all__ = ["BODY", "UserObject", "object_name", "read_user_object", "write_user_object"]

BODY = "body.npz"
"""Name of the file in the folder of a data set."""
LONGEST = 40  # characters of a name


@dataclass(frozen=True, eq=False)
class UserObject:
    """A soft object that was made of a shape."""

    item: SoftObject
    like: str
    """The trained object that it is like."""
    source: str = ""
    """Identifies what it was made of, so that a data set is not continued with another shape or material."""
    made: str = ""
    """How it was made, in one line."""


def object_name(text: str) -> str:
    """Makes the name of an object from the name of a file: letters, digits and hyphens, and none of the seven."""
    name = re.sub(r"[^a-z0-9]+", "-", Path(text).stem.lower())[:LONGEST].strip("-") or "shape"
    return f"own-{name}" if name in OBJECTS else name


def write_user_object(folder: Path, body: UserObject) -> None:
    """Write the file `BODY` of a folder, which is made if it is not there."""
    folder.mkdir(parents=True, exist_ok=True)
    arrays: dict[str, Any] = {
        **arrays_of(body.item),
        "origin": np.array(json.dumps({"like": body.like, "source": body.source, "made": body.made})),
    }
    with atomic_open(folder / BODY) as file:
        np.savez_compressed(file, **arrays)


def read_user_object(folder: Path) -> UserObject | None:
    """The object of a folder; None if there is no file `BODY`. Raises `InputError` for a damaged one."""
    path = folder / BODY
    if not path.exists():
        return None
    try:
        with np.load(path, allow_pickle=False) as file:
            origin = json.loads(str(file["origin"]))
            return UserObject(object_of(file), str(origin["like"]), str(origin["source"]), str(origin.get("made", "")))
    except (OSError, KeyError, ValueError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"soft object {path}: cannot be read ({error})") from None
