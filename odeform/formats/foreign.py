"""Files that are something else than their name says, or of a format that is not read: what to do about them."""

from odeform.errors import InputError

__all__ = ["require_content", "unread"]

MESH, POINTS, SPLATS = ".glb, .obj or .ply", ".ply, .las or .xyz", ".ply or .spz"
UNREAD = {
    **dict.fromkeys((".fbx", ".dae", ".3ds", ".blend", ".abc", ".3mf", ".wrl", ".x3d", ".lwo", ".x", ".ctm"), MESH),
    **dict.fromkeys((".usd", ".usda", ".usdc", ".usdz", ".max", ".ma", ".mb", ".c4d", ".skp", ".3dm", ".drc"), MESH),
    **dict.fromkeys((".step", ".stp", ".iges", ".igs", ".brep", ".sldprt", ".dxf", ".dwg", ".jt", ".3dxml"), MESH),
    **dict.fromkeys((".zae", ".amf", ".ase", ".ac", ".ms3d", ".md2", ".b3d", ".xaml", ".ifc", ".gts"), MESH),
    **dict.fromkeys((".e57", ".ptx", ".bag", ".rcp", ".rcs", ".fls", ".zfs", ".bin"), POINTS),
    **dict.fromkeys((".lcc", ".splt", ".rad"), SPLATS),
    **dict.fromkeys((".vtm", ".vtr", ".vts", ".vti", ".pvd", ".xdmf", ".inp", ".bdf", ".med", ".mesh"), ".vtu or .vtk"),
    ".vrm": ".glb",
}
"""Formats that are not read -> what to convert them to."""
PACKED = (".zip", ".gz", ".tgz", ".tar", ".7z", ".rar", ".bz2", ".xz", ".zst")
MOTIONS = (".npz", ".c3d", ".series")
"""Formats that `odeform import` reads."""
ARCHIVES = {b"PK\x03\x04": "zip", b"\x1f\x8b": "gzip", b"7z\xbc\xaf\x27\x1c": "7z", b"Rar!": "rar", b"BZh": "bzip2"}
ARCHIVED = {".sog": "zip", ".spz": "gzip"}
"""Formats that are archives themselves."""
PAGES = (b"<!doctype html", b"<html", b"<head", b"<body")


def unread(suffix: str) -> str:
    """Says what to do with a format that is known and not read; empty for others."""
    if suffix in PACKED:
        return f"{suffix} is not read: unpack it first"
    if suffix in MOTIONS:
        return f"{suffix} holds a motion, not a shape: `odeform import` reads it"
    return f"{suffix} is not read: convert it to {UNREAD[suffix]}" if suffix in UNREAD else ""


def require_content(head: bytes, suffix: str, where: str) -> None:
    """Raise `InputError` where the first bytes of a file show that it is not what its name says."""
    start = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if not head:
        raise InputError(f"{where}: expected {suffix}, got an empty file of no bytes")
    if not start.strip(b"\0"):
        raise InputError(f"{where}: expected {suffix}, got a file that starts with {len(head)} zeros or blanks")
    if start.startswith(b"version https://git-lfs"):
        raise InputError(
            f"{where}: expected {suffix}, got a pointer of Git LFS: run `git lfs pull` for the file itself"
        )
    if start[:20].lower().startswith(PAGES):
        raise InputError(f"{where}: expected {suffix}, got a page of HTML: download the file itself")
    kind = next((name for magic, name in ARCHIVES.items() if head.startswith(magic)), "")
    if kind and ARCHIVED.get(suffix) != kind:
        raise InputError(f"{where}: expected {suffix}, got a {kind} archive: unpack it first")
