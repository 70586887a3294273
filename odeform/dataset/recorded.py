"""A stored sequence by its name, as a motion."""

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
    dataset = open_dataset(root or ".")
    entry = next((e for e in dataset.select("all") if e.name == name.removesuffix(".npz")), None)
    if entry is None:
        raise InputError(f"sequence {origin}: {dataset.root} has no sequence {name!r}")
    return RecordedMotion(dataset.schema, dataset.read(entry), dataset.fixed)
