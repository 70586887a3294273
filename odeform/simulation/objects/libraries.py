"""The meshing libraries of the extra `objects`, imported when they are needed."""

import sys
from importlib import import_module
from types import ModuleType
from typing import Any

from odeform.errors import InputError

__all__ = ["manifold3d", "pytetwild"]


def manifold3d() -> Any:
    """The module `manifold3d`. Raises `InputError` if it is not installed."""
    return _imported("manifold3d")


def pytetwild() -> Any:
    """The module `pytetwild`. Raises `InputError` if it is not installed.

    Version 0.4 imports PyVista, which is not among its requirements, to register an accessor that is not used here. If
    PyVista is missing, an empty module stands in for it during the import.
    """
    if "pytetwild" in sys.modules:
        return sys.modules["pytetwild"]
    try:
        import_module("pyvista")
    except ImportError:
        stand_in: Any = ModuleType("pyvista")
        stand_in.PolyData = stand_in.UnstructuredGrid = object
        sys.modules["pyvista"] = stand_in
        try:
            return _imported("pytetwild")
        finally:
            del sys.modules["pyvista"]
    return _imported("pytetwild")


def _imported(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError as error:
        raise InputError(f"meshing needs {name}: install it with pip install 'odeform[objects]' ({error})") from None
