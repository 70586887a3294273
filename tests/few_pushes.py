"""Some pushes of the bundled objects."""

from dataclasses import replace

from odeform.dataset.index import Dataset
from odeform.dataset.store import open_dataset

KEPT = {"train": 4, "val": 2, "test": 1}


def few_pushes(*names: str) -> Dataset:
    """Four to train on, two to validate on and one to test on, of each object."""
    dataset = open_dataset("contact-force").of(*names)
    entries = [e for name in names for split, n in KEPT.items() for e in dataset.select(split, name)[:n]]
    return replace(dataset, entries=tuple(entries))
