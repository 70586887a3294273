"""Opening a data set: a folder, a packed file, or the bundled copy of a scene."""

from pathlib import Path

from odeform.dataset.folder import INDEX, open_folder
from odeform.dataset.index import Dataset
from odeform.dataset.packed import SUFFIX, open_packed
from odeform.io import bundled

__all__ = ["bundled_datasets", "open_dataset"]


def bundled_datasets() -> dict[str, Path]:
    """The bundled data sets by name; most have that of their scene. They come with a clone, not with a wheel."""
    return {path.stem: path for path in sorted(bundled("datasets").glob(f"*{SUFFIX}"))}


def open_dataset(name: str | Path) -> Dataset:
    """Open a data set.

    Args:
        name: A folder that `odeform simulate` or `odeform import` wrote, an `.odp` file of `odeform pack`, or the name
            of a bundled data set (a clone has one for each scene; a wheel has none).

    Raises:
        InputError: No data set is there, or it is damaged.

    Examples:
        >>> import odeform
        >>> dataset = odeform.open_dataset("mass-elastic")
        >>> {split: len(dataset.select(split)) for split in ("train", "val", "test")}
        {'train': 350, 'val': 50, 'test': 100}
    """
    path = Path(name)
    if not path.is_file() and not (path / INDEX).exists():
        path = bundled_datasets().get(str(name), path)
    return open_packed(path) if path.is_file() else open_folder(path)
