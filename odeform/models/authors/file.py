"""The authors' checkpoints: a `torch.save`d dict of two state dicts, read without executing anything in the file.

The kind of network follows from the shapes of its weights; `args` only says which frames it was trained on.
"""

import hashlib
import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from odeform.budget import require_memory
from odeform.checkpoint import Checkpoint, checkpoint_bytes
from odeform.dataset.importers.authors import AUTHORS_CONTACT_FORCE, AUTHORS_MASS_ELASTIC
from odeform.errors import InputError
from odeform.geometry.primitives import octasphere
from odeform.models.authors.network import Networks
from odeform.schema import Parameter, Schema, Window
from odeform.types import Arrays

__all__ = ["ENDING", "MODEL", "PARTS", "read_authors_checkpoint"]

ENDING = ".pth"
MODEL = "released"
PARTS = {"global": "model1_state_dict", "local": "model2_state_dict"}
MOST_FRAMES = 10_000
NUMBER_BYTES = 12  # of memory while reading
RADIUS, SEGMENTS = 0.1, 8  # of the ball that serves as body: metres, and edges per side of an octant

SCENES = {1: AUTHORS_MASS_ELASTIC, 3: AUTHORS_CONTACT_FORCE}
"""Scenes by the components of an offset: height alone, or all three axes."""
FRAMES = {AUTHORS_MASS_ELASTIC: (40, 20, 20), AUTHORS_CONTACT_FORCE: (0, 10, 10)}
"""First frame, number of frames, and frames per second where `args` does not say."""
NOTES = (
    "A network of the paper's authors: one latent state per point, valid on its training frames only.",
    "The file contains no body: a ball of radius 0.1 m is used unless a geometry is given.",
)


def read_authors_checkpoint(path: str | Path) -> Checkpoint:
    """Read and validate a `.pth`; `InputError` in one line for anything that is not a checkpoint of the authors."""
    path = Path(path)
    data = checkpoint_bytes(path)
    content = _loaded(data, path)
    arrays = {
        f"{part}.{name}": array
        for part, key in PARTS.items()
        for name, array in _arrays(content.get(key), path, key).items()
    }
    try:
        networks = Networks.read(arrays)
        scene = SCENES[networks.offsets]
        first, count, rate = _frames(content.get("args"), scene)
    except (KeyError, TypeError, ValueError, OverflowError, IndexError, AttributeError) as error:
        raise InputError(f"checkpoint {path}: not one of the released networks: missing or wrong {error}") from None
    ball = octasphere(RADIUS, SEGMENTS)
    return Checkpoint(
        model=MODEL,
        schema=_schema(scene, Window(first / rate, (first + count - 1) / rate, rate)),
        config={"encoder": networks.kind, "first_frame": first, "frames": count},
        arrays={**arrays, "rest.points": ball.points, "rest.faces": ball.faces},
        provenance={"format": "released", **_plain(content)},
        sha256=hashlib.sha256(data).hexdigest(),
        size_bytes=len(data),
    )


def _loaded(data: bytes, path: Path) -> Mapping[str, Any]:
    import torch

    _require_stored(data, path)
    try:
        content = torch.load(io.BytesIO(data), map_location="cpu", weights_only=True)
    except Exception:
        # a broken file raises any of these; the messages of the parser itself advise to load it unsafely
        raise InputError(
            f"checkpoint {path}: not a file of weights alone that PyTorch can read, or truncated"
        ) from None
    if not isinstance(content, Mapping):
        raise InputError(f"checkpoint {path}: expected a dict with {', '.join(PARTS.values())}")
    return content


def _require_stored(data: bytes, path: Path) -> None:
    """`InputError` for an archive whose members are compressed: they could be of any size."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
    except (zipfile.BadZipFile, ValueError, OverflowError, NotImplementedError):
        return  # the older format, or damaged: PyTorch says so
    if any(member.compress_type != zipfile.ZIP_STORED for member in members):
        raise InputError(f"checkpoint {path}: expected stored members, as PyTorch writes, got compressed ones")


def _arrays(state: Any, path: Path, key: str) -> Arrays:
    """A state dict as float32 arrays; its counters of batches are left out."""
    import torch

    if not isinstance(state, Mapping) or not state:
        raise InputError(f"checkpoint {path}: expected a dict of weights at {key}, got {type(state).__name__}")
    arrays: Arrays = {}
    total = sum(value.numel() for value in state.values() if isinstance(value, torch.Tensor))
    # views of one number, with strides of zero, may claim any size
    require_memory(f"checkpoint {path}", f"{total:,} numbers at {key}", NUMBER_BYTES * total)
    for name, value in state.items():
        if not isinstance(value, torch.Tensor) or value.layout != torch.strided or value.is_quantized:
            raise InputError(f"checkpoint {path}: {key}: expected a dense tensor at {name!r}")
        if value.is_floating_point():
            arrays[str(name)] = value.detach().to(torch.float32).contiguous().numpy()
            if not np.isfinite(arrays[str(name)]).all():
                raise InputError(f"checkpoint {path}: {key}: {name!r} contains numbers that are not finite")
    return arrays


def _frames(args: Any, scene: str) -> tuple[int, int, float]:
    """First frame, number of frames, frames per second."""
    given = args if isinstance(args, Mapping) else {}
    first, count, rate = (
        given.get(name, default)
        for name, default in zip(("seq_start_idx", "sequence_length", "fps"), FRAMES[scene], strict=True)
    )
    first, count, rate = int(first), int(count), float(rate)
    if not (0 <= first <= MOST_FRAMES and 2 <= count <= MOST_FRAMES and 0.0 < rate <= MOST_FRAMES):
        raise ValueError(f"args: {count} frames from {first} on at {rate:g} per second")
    return first, count, rate


def _plain(content: Mapping[str, Any]) -> dict[str, Any]:
    """Other metadata of the file, as far as JSON can hold it."""
    plain = {name: content[name] for name in ("epoch", "loss") if isinstance(content.get(name), int | float)}
    args = content.get("args")
    if isinstance(args, Mapping):
        plain["args"] = {str(k): v for k, v in args.items() if isinstance(v, str | int | float | bool | None)}
    return plain


def _schema(scene: str, window: Window) -> Schema:
    if scene == AUTHORS_MASS_ELASTIC:
        parameters = (
            Parameter("mass", "kg", 0.1, 3.0, 1.0, description="mass of the body"),
            Parameter("bending", "N m", 0.1, 3.0, 1.0, description="bending stiffness of its springs"),
            Parameter("initial_offset", "m", 0.0, 1.0, 0.5, description="drop height"),
        )
    else:
        parameters = (
            *_vector("contact", "m", 1.0, 0.5, "point of contact"),
            *_vector("force", "N", 1.0, 0.5, "applied force"),
            *_vector("initial_offset", "m", 0.5, 0.0, "initial position"),
        )
    return Schema(scene, parameters, window, notes=NOTES)


def _vector(name: str, unit: str, largest: float, first: float, text: str) -> tuple[Parameter, ...]:
    """Three parameters, NAME_x to NAME_z, each from -largest to largest; `Schema.complete` also accepts them as one."""
    return tuple(
        Parameter(
            f"{name}_{axis}", unit, -largest, largest, first if axis == "x" else 0.0, description=f"{text}, {axis}"
        )
        for axis in "xyz"
    )
