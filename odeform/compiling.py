"""Whether steps in time run as machine code, compiled by Numba, or in NumPy, which is their reference."""

import hashlib
import os
from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

__all__ = ["compiled_with", "compiles"]


@cache
def compiles() -> bool:
    """True where Numba is installed, unless the environment says ODEFORM_COMPILE=0."""
    return os.environ.get("ODEFORM_COMPILE", "1") != "0" and find_spec("numba") is not None


def compiled_with(*sources: str, inline: bool = False) -> Callable[[Callable[..., Any]], Any]:
    """Compiles functions that call those of other files, `sources`, and keeps what is compiled for as long as none of
    these files changes.

    Numba's cache of a function looks at the function's own file only. So this has a folder for each content of all.
    With `inline` they become part of those that call them: each call of another function counts references to all
    arrays that it takes, which small functions spend more time on than on what they do.
    """
    import numba  # importing it takes half a second
    from numba.core import config as settings

    config: Any = settings

    digest = hashlib.sha256(b"".join(Path(source).read_bytes() for source in sources)).hexdigest()[:16]
    folder = Path(config.CACHE_DIR or Path(sources[0]).parent / "__pycache__") / f"odeform_{digest}"
    # sums may be reordered, so that they use all lanes of a vector; what is not finite stays so
    make = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract"}, forceinline=inline)

    def compile_one(function: Callable[..., Any]) -> Any:
        known = config.CACHE_DIR
        config.CACHE_DIR = str(folder)
        try:
            return make(function)
        finally:
            config.CACHE_DIR = known

    return compile_one
