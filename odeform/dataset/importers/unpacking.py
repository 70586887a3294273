"""Zipped folders, unpacked into a temporary one."""

import shutil
import stat
import tempfile
import weakref
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from odeform.budget import MEMORY
from odeform.dataset.importers.frame_folder import visible
from odeform.errors import InputError

__all__ = ["Unpacked"]

MOST = 200_000  # files
RATIO = 1000  # of the content to what it takes in the archive
ENCRYPTED = 1


class Unpacked:
    """The content of a zip archive in a temporary folder, which is removed with this object.

    Raises `InputError`, before anything is written, for paths that lead out of the folder, links, passwords, and more
    than 2 GB, 200,000 files or a thousand times the size of the archive.
    """

    root: Path
    """The folder, named as the archive; or where it holds a single folder and nothing else, that one."""

    def __init__(self, path: Path) -> None:
        where = f"import {path}"
        self._path, self._folder = path, Path(tempfile.mkdtemp(prefix="odeform-")) / path.stem
        weakref.finalize(self, shutil.rmtree, self._folder.parent, ignore_errors=True)
        try:
            with zipfile.ZipFile(path) as archive:
                _require_harmless(archive.infolist(), path.stat().st_size, where)
                archive.extractall(self._folder)
        except InputError:
            raise
        except OSError as error:
            raise InputError(f"{where}: cannot be unpacked: {error.strerror or error}") from None
        except (zipfile.BadZipFile, zlib.error, NotImplementedError, EOFError, ValueError, RuntimeError) as error:
            raise InputError(f"{where}: a damaged zip archive: {error or type(error).__name__}") from None
        inside = visible(self._folder)
        self.root = inside[0] if len(inside) == 1 and inside[0].is_dir() else self._folder

    def renamed(self, message: str) -> str:
        """Returns a message with the path of the archive in place of the temporary folder."""
        return message.replace(str(self._folder), str(self._path))

    @contextmanager
    def named(self) -> Iterator[None]:
        """Returns a context in which an `InputError` names the archive instead of the temporary folder."""
        try:
            yield
        except InputError as error:
            raise InputError(self.renamed(str(error))) from None


def _require_harmless(members: list[zipfile.ZipInfo], size: int, where: str) -> None:
    content = sum(member.file_size for member in members)
    if len(members) > MOST:
        raise InputError(f"{where}: expected at most {MOST:,} files, got {len(members):,}")
    if content > MEMORY or content > RATIO * size:
        raise InputError(
            f"{where}: expected at most {MEMORY / 1e9:.3g} GB, and {RATIO} times the archive, got {content:,} bytes "
            f"of {size:,}: unpack it yourself"
        )
    names: set[str] = set()
    for member in members:
        parts = PurePosixPath(member.filename.replace("\\", "/"))
        if parts.is_absolute() or ".." in parts.parts or ":" in member.filename or "\0" in member.orig_filename:
            raise InputError(f"{where}: expected paths inside the archive, got {member.filename}")
        if stat.S_ISLNK(member.external_attr >> 16):
            raise InputError(f"{where}: expected files and folders, got the link {member.filename}")
        if member.flag_bits & ENCRYPTED:
            raise InputError(f"{where}: {member.filename} has a password: unpack it yourself")
        if str(parts) in names:
            raise InputError(f"{where}: {member.filename} is there twice")
        names.add(str(parts))
