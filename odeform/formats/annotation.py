"""Sentences for people in files of single shapes: what has to be known of the motion that a frame comes from."""

import json
from collections.abc import Callable, Sequence

from odeform.formats.glb import glb_bytes

__all__ = ["annotated"]

STL_HEADER = 80  # bytes, of any content; "solid" at its start would say that the file is text
GLB_JSON = 20  # bytes before the first chunk's content: 12 of the file, 8 of the chunk


def annotated(data: bytes, suffix: str, notes: Sequence[str]) -> bytes:
    """The content of a finished file with `notes`, where its format (`suffix`, with its dot) has a place for them.

    They are comments of PLY and OBJ, `asset.extras.notes` of GLB, and the header of STL as far as its 80 bytes go.
    """
    write = WRITERS.get(suffix)
    return data if write is None or not notes else write(data, [" ".join(note.split()) for note in notes])


def _ply(data: bytes, notes: Sequence[str]) -> bytes:
    kind, layout, rest = data.split(b"\n", 2)
    comments = b"".join(f"comment {_ascii(note)}\n".encode() for note in notes)
    return b"\n".join([kind, layout, comments + rest])


def _obj(data: bytes, notes: Sequence[str]) -> bytes:
    return b"".join(f"# {note}\n".encode() for note in notes) + data


def _stl(data: bytes, notes: Sequence[str]) -> bytes:
    header = _ascii("; ".join(notes)).encode()[:STL_HEADER]
    return header.ljust(STL_HEADER) + data[STL_HEADER:]


def _glb(data: bytes, notes: Sequence[str]) -> bytes:
    end = GLB_JSON + int.from_bytes(data[12:16], "little")
    content = json.loads(data[GLB_JSON:end])
    content["asset"]["extras"] = {**content["asset"].get("extras", {}), "notes": list(notes)}
    return glb_bytes(content, data[end:])


def _ascii(text: str) -> str:
    return text.encode("ascii", "replace").decode()


WRITERS: dict[str, Callable[[bytes, Sequence[str]], bytes]] = {".ply": _ply, ".obj": _obj, ".stl": _stl, ".glb": _glb}
