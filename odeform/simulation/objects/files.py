"""Soft objects as compressed npz files."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.simulation.objects.soft_object import SoftMaterial, SoftObject

__all__ = ["arrays_of", "object_of", "read_object"]


def arrays_of(item: SoftObject) -> dict[str, Any]:
    """The arrays of a file; positions are rounded to float32 (10 nm)."""
    about = {"name": item.name, "forces": item.forces, "thickness": item.thickness, "material": asdict(item.material)}
    return {
        "points": item.points.astype(np.float32),
        "settled": item.settled.astype(np.float32),
        "elements": item.elements.astype(np.uint16),
        "faces": item.faces.astype(np.uint16),
        "about": np.array(json.dumps(about)),
    }


def object_of(arrays: Mapping[str, Any]) -> SoftObject:
    """The inverse of `arrays_of`; KeyError, ValueError or TypeError where something is missing or wrong."""
    about = json.loads(str(arrays["about"]))
    return SoftObject(
        name=about["name"],
        points=arrays["points"].astype(float),
        elements=arrays["elements"].astype(np.int32),
        faces=arrays["faces"].astype(np.int32),
        settled=arrays["settled"].astype(float),
        material=SoftMaterial(**about["material"]),
        forces=(about["forces"][0], about["forces"][1]),
        thickness=about["thickness"],
    )


def read_object(path: Path) -> SoftObject:
    """Read a file of `arrays_of`. Raises `InputError` if it cannot be read."""
    try:
        with np.load(path, allow_pickle=False) as file:
            return object_of(file)
    except (OSError, KeyError, ValueError, TypeError) as error:
        raise InputError(f"soft object {path}: cannot be read ({error})") from None
