"""LZF decompression, as of compressed .pcd files: python-lzf needs a compiler to install.

http://oldhome.schmorp.de/marc/liblzf.html
"""

from odeform.errors import InputError

__all__ = ["decompressed"]

LITERALS = 32  # control bytes below copy as many bytes, plus one, from the input


def decompressed(data: bytes, size: int, where: str) -> bytes:
    """Returns the `size` bytes that `data` packs. Raises `InputError`, which `where` leads, for any other number."""
    out = bytearray()
    position, end = 0, len(data)
    while position < end and len(out) <= size:
        control = data[position]
        position += 1
        if control < LITERALS:
            out += data[position : position + control + 1]
            position += control + 1
            continue
        length = control >> 5
        if length == 7 and position < end:
            length += data[position]
            position += 1
        if position >= end:
            break
        start = len(out) - ((control & 31) << 8) - data[position] - 1
        position, length = position + 1, length + 2
        if start < 0:
            raise InputError(f"{where}: damaged compressed data at byte {position:,}")
        if start + length <= len(out):
            out += out[start : start + length]
        else:  # what is copied overlaps what it is copied to
            piece = out[start:]
            out += (piece * (length // len(piece) + 1))[:length]
    if len(out) != size:
        raise InputError(f"{where}: expected {size:,} bytes of compressed data, got {len(out):,}: truncated?")
    return bytes(out)
