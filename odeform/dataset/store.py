"""Opening a data set, wherever it is: a folder, a packed file, or the bundled copy of a scene."""

from pathlib import Path

from odeform.dataset.folder import INDEX, open_folder
from odeform.dataset.index import Dataset
from odeform.dataset.packed import SUFFIX, open_packed
from odeform.io import bundled

__all__ = ["bundled_datasets", "open_dataset"]


def bundled_datasets() -> dict[str, Path]:
    """The packed data sets beside the package, by scene. A wheel has none."""
    return {path.stem: path for path in sorted(bundled("datasets").glob(f"*{SUFFIX}"))}


def open_dataset(name: str | Path) -> Dataset:
    """The data set of that path, or else the bundled copy of that scene."""
    path = Path(name)
    if not path.is_file() and not (path / INDEX).exists():
        path = bundled_datasets().get(str(name), path)
    return open_packed(path) if path.is_file() else open_folder(path)
