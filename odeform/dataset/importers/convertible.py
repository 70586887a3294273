"""Formats of motions that are not read, and what to do instead."""

from collections.abc import Iterable

__all__ = ["convertible"]

ADVICE = {
    (
        ".abc",
        ".usd",
        ".usda",
        ".usdc",
        ".usdz",
        ".fbx",
        ".dae",
        ".blend",
    ): "export .obj or .ply frames",
    (".bgeo", ".sc", ".geo"): "let Houdini write .obj frames, as name.$F4.obj",
    (".mdd", ".pc2", ".mc", ".mcx"): "a point cache has no mesh; export .obj or .ply frames",
    (".glb", ".gltf"): "export .obj or .ply frames, which keep the order of vertices",
    (".pvtu", ".pvtp", ".vtm", ".vtmb", ".vtkhdf", ".vts", ".vti", ".vtr"): "save one .vtu or .vtp for each frame",
    (".bvh", ".trc", ".asf", ".amc"): "of motion capture, .c3d is read",
    (".mat", ".npy", ".h5", ".hdf5"): "save times (T,) and vertices (T, N, 3) in an .npz",
    (".xdmf", ".xmf", ".msh", ".inp", ".odb", ".rst", ".exo", ".e", ".cgns", ".frd", ".vol", ".med"): (
        "save .vtu frames, with ParaView or meshio"
    ),
    (".7z", ".rar", ".tar", ".gz", ".tgz", ".bz2", ".xz"): "unpack it, or pack it as .zip",
    (".xyz", ".pcd", ".las", ".laz", ".pts", ".splat", ".spz"): "frames have faces; .npz and .c3d hold points",
}


def convertible(endings: Iterable[str]) -> str:
    """Says in a clause how to convert files of the first of `endings` that is known but not read; empty for others."""
    advice = {ending: text for known, text in ADVICE.items() for ending in known}
    return next((f": {ending} is not read: {advice[ending]}" for ending in endings if ending in advice), "")
