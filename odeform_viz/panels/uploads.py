"""Files that a browser uploads."""

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path

import viser

from odeform.errors import InputError

__all__ = ["content_of", "path_of", "take_upload"]

LARGEST = 256 << 20  # bytes of an upload


def take_upload(event: viser.GuiEvent) -> viser.UploadedFile:
    """The uploaded file of an event. Its button, which would keep the content in memory, forgets it."""
    button = event.target
    assert isinstance(button, viser.GuiUploadButtonHandle)
    file = button.value
    button._impl.value = viser.UploadedFile("", b"")  # its setter would send it to all clients
    return file


def content_of(file: viser.UploadedFile) -> bytes:
    """Returns the content; `InputError` for one of more than 256 MiB."""
    if len(file.content) > LARGEST:
        raise InputError(f"{file.name}: {len(file.content) >> 20} MiB; expected at most {LARGEST >> 20} MiB")
    return file.content


@contextlib.contextmanager
def path_of(file: viser.UploadedFile) -> Iterator[Path]:
    """A path to the content, for readers that take one; it exists within the context.

    An `InputError` that names the path leaves the context with the name of the uploaded file.
    """
    with tempfile.TemporaryDirectory(prefix="odeform-") as folder:
        path = Path(folder) / f"upload{Path(file.name).suffix}"
        path.write_bytes(content_of(file))
        try:
            yield path
        except InputError as error:
            raise InputError(str(error).replace(str(path), file.name).replace(path.name, file.name)) from None
