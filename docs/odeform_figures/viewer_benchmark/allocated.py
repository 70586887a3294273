"""How much memory malloc has given out."""

import ctypes
import sys

__all__ = ["allocated_mb"]


class _Usage(ctypes.Structure):
    """glibc's `mallinfo2`."""

    _fields_ = [(name, ctypes.c_size_t) for name in ["arena", "ordblks", "smblks", "hblks", "hblkhd"]]
    _fields_ += [(name, ctypes.c_size_t) for name in ["usmblks", "fsmblks", "uordblks", "fordblks", "keepcost"]]


def allocated_mb() -> float | None:
    """MB that malloc has given out and that are not freed (glibc; otherwise None).

    What the process holds besides is code, small objects of Python, and free memory between pieces that are in use.
    """
    libc = ctypes.CDLL(None) if sys.platform == "linux" else None
    if libc is None or not hasattr(libc, "mallinfo2"):
        return None
    libc.mallinfo2.restype = _Usage
    usage = libc.mallinfo2()
    return (usage.uordblks + usage.hblkhd) / 1e6
