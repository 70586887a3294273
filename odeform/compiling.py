"""Whether steps in time run as machine code, compiled by Numba, or in NumPy, which is their reference."""

import os
from functools import cache
from importlib.util import find_spec

__all__ = ["compiles"]


@cache
def compiles() -> bool:
    """True where Numba is installed, unless the environment says ODEFORM_COMPILE=0."""
    return os.environ.get("ODEFORM_COMPILE", "1") != "0" and find_spec("numba") is not None
