"""The layouts that `odeform import` recognises. A layout is one module and one line here."""

import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from odeform.dataset.importers.authors import authors_source, is_authors_layout
from odeform.dataset.importers.conversion import convert_source
from odeform.dataset.importers.convertible import convertible
from odeform.dataset.importers.mesh_frames import has_table, mesh_source
from odeform.dataset.importers.source import Source
from odeform.dataset.importers.units import METRES
from odeform.dataset.importers.unpacking import Unpacked
from odeform.dataset.index import Dataset
from odeform.errors import InputError

__all__ = ["IMPORTERS", "Importer", "import_dataset"]


@dataclass(frozen=True)
class Importer:
    """How a folder of some layout becomes a data set."""

    description: str
    """Describes what the folder contains, for error messages."""
    recognises: Callable[[Path], bool]
    source: Callable[[Path, float | None], Source]
    """(folder, frame rate in Hz if the user gave one) -> its sequences. Raises `InputError`."""


IMPORTERS: dict[str, Importer] = {
    "meshes": Importer("parameters.csv or parameters.json (a folder of mesh frames)", has_table, mesh_source),
    "released": Importer("folders with params.json (the authors' layout)", is_authors_layout, authors_source),
}


def import_dataset(
    source: str | Path, out: str | Path, rate: float | None = None, seed: int = 0, unit: str = "m"
) -> Dataset:
    """Convert the folder or zip archive `source`, of any layout in `IMPORTERS`, to a data set in the folder `out`.

    `rate` in Hz is for layouts that store none; `seed` draws the splits of a source without them; `unit` is that of
    lengths in files that do not say it (`odeform.dataset.importers.units`). What was assumed or left out is in
    `provenance["notes"]` of the data set. Raises `InputError` for a layout that none recognises, for an inconsistent
    one, and if no sequence can be read.
    """
    root, to = Path(source), Path(out)
    if seed < 0:
        raise InputError(f"import: expected a seed of at least 0, got {seed}")
    if unit not in METRES:
        raise InputError(f"import: expected a unit of {', '.join(METRES)}, got {unit!r}")
    if root.is_file() and zipfile.is_zipfile(root):
        archive = Unpacked(root)
        with archive.named():
            return _imported(archive.root, to, rate, seed, unit, archive.renamed)
    if root.is_file():
        hint = convertible([root.suffix.lower()]) or ": put it in a folder with parameters.csv"
        raise InputError(f"import {root}: expected a folder or a zip archive, got a file{hint}")
    if not root.is_dir():
        raise InputError(f"import {root}: no such folder")
    if to.resolve() == root.resolve():
        raise InputError(f"import: --out {to}: expected another folder than the source")
    return _imported(root, to, rate, seed, unit, str)


def _imported(
    root: Path, out: Path, rate: float | None, seed: int, unit: str, renamed: Callable[[str], str]
) -> Dataset:
    for importer in IMPORTERS.values():
        if importer.recognises(root):
            return convert_source(importer.source(root, rate), out, seed, unit, renamed)
    raise InputError(f"import {root}: expected {', or '.join(i.description for i in IMPORTERS.values())}")
