"""What `odeform import` takes: the released layout, or a folder of mesh frames."""

from pathlib import Path

from odeform.dataset.importers.authors import authors_source, is_authors_layout
from odeform.dataset.importers.mesh_frames import TABLES, mesh_source, table_of
from odeform.dataset.importers.source import import_source
from odeform.dataset.index import Dataset
from odeform.errors import InputError

__all__ = ["import_dataset"]


def import_dataset(source: str | Path, out: str | Path, rate: float | None = None, seed: int = 0) -> Dataset:
    """Find out what lies in the folder `source`, and write it as a data set into the folder `out`.

    `rate` is that of mesh frames in Hz; `seed` draws the splits of a source that has none.
    """
    root, to = Path(source), Path(out)
    if not root.is_dir():
        raise InputError(f"import {root}: no such folder")
    if to.resolve() == root.resolve():
        raise InputError(f"import: --out {to}: expected another folder than the source")
    if table := table_of(root):
        return import_source(mesh_source(root, table, rate), to, seed)
    if is_authors_layout(root):
        if rate is not None:
            raise InputError("import: --rate is for mesh frames: the released layout has its own")
        return import_source(authors_source(root), to, seed)
    raise InputError(
        f"import {root}: expected sequence folders with params.json (the released layout), or {' or '.join(TABLES)}"
    )
