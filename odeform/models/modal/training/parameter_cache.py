"""The contact parameters that an interrupted training of the mechanical model has finished."""

import hashlib
import json
from pathlib import Path

from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.io import atomic_write, parse_json
from odeform.mechanics.contact_parameters import ContactParameters

__all__ = ["SHARED", "ParameterCache"]

SHARED = "all objects"
"""The name of the contact parameters that are fitted to all objects together."""


class ParameterCache:
    """Contact parameters by the name of their object, in a file that is written again whenever one is added."""

    def __init__(self, path: Path | None, dataset: Dataset, seed: int, resume: bool = False) -> None:
        """Reads with `resume` those that the file has; without a `path`, none are kept.

        `InputError` if it is damaged or of another training.
        """
        self.path = path
        self._training = {"data": _digest(dataset), "window_s": dataset.schema.window.stop, "seed": seed}
        self._known = {} if path is None or not resume else self._read(path)

    def get(self, name: str) -> ContactParameters | None:
        """None for contact parameters that is not finished."""
        return self._known.get(name)

    def add(self, name: str, contact_parameters: ContactParameters) -> None:
        """Keep finished contact parameters."""
        self._known[name] = contact_parameters
        if self.path is None:
            return
        known_parameters = {known: value.to_json() for known, value in self._known.items()}
        atomic_write(self.path, json.dumps({"training": self._training, "laws": known_parameters}, indent=1).encode())

    def _read(self, path: Path) -> dict[str, ContactParameters]:
        try:
            data = path.read_bytes()
        except OSError as error:
            raise InputError(f"--resume: {path}: {error.strerror}; expected an interrupted training") from None
        try:
            known = parse_json(data, str(path))
            training = known["training"]
            known_parameters = {name: ContactParameters.from_json(values) for name, values in known["laws"].items()}
        except (KeyError, TypeError, AttributeError, ValueError) as error:
            raise InputError(f"--resume: {path}: not a state of this training: {error}") from None
        if training != self._training:
            raise InputError(f"--resume: {path}: state of another training: expected {self._training}, got {training}")
        return known_parameters


def _digest(dataset: Dataset) -> str:
    """Hashes the motions that are trained on and those that choose."""
    entries = [(entry.name, entry.split, entry.sha256) for entry in dataset.entries if entry.split != "test"]
    return hashlib.sha256(json.dumps(entries).encode()).hexdigest()
