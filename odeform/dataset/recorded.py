"""A stored sequence by its name, as a motion."""

from pathlib import Path

from odeform.dataset.folder import INDEX
from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.motion.recorded import RecordedMotion

__all__ = ["read_recorded"]


def read_recorded(origin: str) -> RecordedMotion:
    """The sequence DATASET/NAME of a folder, a packed file, or a scene's bundled data set.

    Raises:
        InputError: There is no such data set or sequence.
    """
    root, _, name = origin.rpartition("/")
    if Path(origin).exists() and not (Path(root) / INDEX).is_file() and not Path(root).is_file():
        raise InputError(
            f"sequence {origin}: expected DATASET/NAME, a sequence of a data set: make one of your own files with "
            "`odeform import`, or open an .npz in the page under Truth"
        )
    dataset = open_dataset(root or ".")
    entry = next((e for e in dataset.select("all") if e.name == name.removesuffix(".npz")), None)
    if entry is None:
        raise InputError(f"sequence {origin}: {dataset.root} has no sequence {name!r}")
    return RecordedMotion(dataset.schema, dataset.read(entry), dataset.fixed)
