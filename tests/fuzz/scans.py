"""Files of points and volume meshes for tests, made by code."""

import base64
import io
import json
import struct
import zipfile
import zlib
from collections.abc import Mapping

import laspy
import numpy as np
from PIL import Image

__all__ = [
    "CUBE",
    "HEXAHEDRON",
    "ksplat_bytes",
    "las_bytes",
    "lzf_literals",
    "msh_bytes",
    "pcd_bytes",
    "sog_bytes",
    "vtk_bytes",
    "vtu_bytes",
]

CUBE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
"""Corners of a unit cube, in the order of VTK's hexahedron."""
HEXAHEDRON = 12


def lzf_literals(data: bytes) -> bytes:
    """LZF of runs without any repetition."""
    parts = [data[start : start + 32] for start in range(0, len(data), 32)]
    return b"".join(bytes([len(part) - 1]) + part for part in parts)


def pcd_bytes(points: np.ndarray, colors: np.ndarray | None = None, kind: str = "ascii") -> bytes:
    """A .pcd of points (N, 3), with colors (N, 3) as PCL packs them."""
    fields = [("x", "<f4"), ("y", "<f4"), ("z", "<f4")] + ([("rgb", "<f4")] if colors is not None else [])
    table = np.zeros(len(points), fields)
    for name, column in zip("xyz", points.T, strict=True):
        table[name] = column
    if colors is not None:
        red, green, blue = colors.astype("<u4").T
        table["rgb"] = (red << 16 | green << 8 | blue).view("<f4")
    count = len(fields)
    header = [
        "# .PCD v0.7 - Point Cloud Data file format",
        "VERSION 0.7",
        f"FIELDS {' '.join(name for name, _ in fields)}",
        f"SIZE {' '.join(['4'] * count)}",
        f"TYPE {' '.join(['F'] * count)}",
        f"COUNT {' '.join(['1'] * count)}",
        f"WIDTH {len(points)}",
        "HEIGHT 1",
        "VIEWPOINT 0 0 0 1 0 0 0",
        f"POINTS {len(points)}",
        f"DATA {kind}",
        "",
    ]
    if kind == "ascii":
        body = "".join(" ".join(f"{value!r}" for value in row.tolist()) + "\n" for row in table).encode()
    elif kind == "binary":
        body = table.tobytes()
    else:
        plain = b"".join(np.ascontiguousarray(table[name]).tobytes() for name, _ in fields)
        packed = lzf_literals(plain)
        body = struct.pack("<II", len(packed), len(plain)) + packed
    return "\n".join(header).encode() + body


def las_bytes(points: np.ndarray, colors: np.ndarray, compressed: bool = False) -> bytes:
    """A .las or .laz of points (N, 3) to a millimetre, with colors (N, 3) of 16 bits."""
    header = laspy.LasHeader(point_format=2, version="1.2")
    header.scales, header.offsets = np.full(3, 1e-3), np.floor(points.min(axis=0))
    scan = laspy.LasData(header)
    scan.x, scan.y, scan.z = points.T
    scan.red, scan.green, scan.blue = colors.astype(np.uint16).T << 8
    out = io.BytesIO()
    scan.write(out, do_compress=compressed)
    return out.getvalue()


def vtk_bytes(points: np.ndarray, cells: list[list[int]], types: list[int], binary: bool = False) -> bytes:
    """A legacy .vtk of an unstructured grid."""
    flat = [value for cell in cells for value in (len(cell), *cell)]

    def numbers(values: np.ndarray) -> bytes:
        text = " ".join(map(str, values.ravel().tolist())).encode()
        return values.astype(values.dtype.newbyteorder(">")).tobytes() if binary else text

    return b"".join(
        [
            b"# vtk DataFile Version 3.0\nmade here\n" + (b"BINARY" if binary else b"ASCII"),
            f"\nDATASET UNSTRUCTURED_GRID\nPOINTS {len(points)} double\n".encode(),
            numbers(points.astype("f8")),
            f"\nCELLS {len(cells)} {len(flat)}\n".encode(),
            numbers(np.array(flat, "i4")),
            f"\nCELL_TYPES {len(cells)}\n".encode(),
            numbers(np.array(types, "i4")),
            b"\n",
        ]
    )


def vtu_bytes(points: np.ndarray, cells: list[list[int]], types: list[int], form: str = "ascii") -> bytes:
    """A .vtu: `form` is ascii, binary, zlib, or appended."""
    raw = b""

    def array(name: str, kind: str, values: np.ndarray) -> str:
        nonlocal raw
        data = values.tobytes()
        size = struct.pack("<I", len(data))
        text = " ".join(map(str, values.ravel().tolist()))
        if form == "binary":
            text = base64.b64encode(size + data).decode()
        elif form == "zlib":
            packed = zlib.compress(data)
            head = struct.pack("<4I", 1, len(data), len(data), len(packed))
            text = (base64.b64encode(head) + base64.b64encode(packed)).decode()
        elif form == "appended":
            text, offset = "", len(raw)
            raw += size + data
            return (
                f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="3" format="appended" offset="{offset}"/>'
            )
        stored = "ascii" if form == "ascii" else "binary"
        return f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="3" format="{stored}">{text}</DataArray>'

    compressor = ' compressor="vtkZLibDataCompressor"' if form == "zlib" else ""
    connectivity = np.array([corner for cell in cells for corner in cell], "<i8")
    text = [
        f'<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt32"{compressor}>',
        f'<UnstructuredGrid><Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}"><Points>',
        array("Points", "Float64", points.astype("<f8")),
        "</Points><Cells>",
        array("connectivity", "Int64", connectivity),
        array("offsets", "Int64", np.cumsum([len(cell) for cell in cells]).astype("<i8")),
        array("types", "UInt8", np.array(types, "u1")),
        "</Cells></Piece></UnstructuredGrid>",
    ]
    end = b'<AppendedData encoding="raw">_' + raw + b"</AppendedData></VTKFile>" if raw else b"</VTKFile>"
    return "".join(text).encode() + end


def msh_bytes(points: np.ndarray, tetrahedra: list[list[int]], version: str = "2.2", binary: bool = False) -> bytes:
    """A .msh of tetrahedra, whose corners count from 0."""
    head = f"$MeshFormat\n{version} {int(binary)} 8\n".encode() + (struct.pack("<i", 1) + b"\n" if binary else b"")
    parts = [head, b"$EndMeshFormat\n$Nodes\n"]
    count, cells = len(points), len(tetrahedra)
    tags = range(1, count + 1)
    if version == "2.2":
        parts.append(f"{count}\n".encode())
        for tag, xyz in zip(tags, points.tolist(), strict=True):
            parts.append(struct.pack("<i3d", tag, *xyz) if binary else f"{tag} {xyz[0]} {xyz[1]} {xyz[2]}\n".encode())
        parts.append(f"$EndNodes\n$Elements\n{cells}\n".encode())
        if binary:
            parts.append(struct.pack("<3i", 4, cells, 2))
        for index, corners in enumerate(tetrahedra, 1):
            row = [index, *([] if binary else [4, 2]), 0, 0, *(corner + 1 for corner in corners)]
            parts.append(struct.pack(f"<{len(row)}i", *row) if binary else (" ".join(map(str, row)) + "\n").encode())
    elif binary:
        parts.append(struct.pack("<4Q3iQ", 1, count, 1, count, 3, 1, 0, count))
        parts.append(struct.pack(f"<{count}Q", *tags) + points.astype("<f8").tobytes())
        parts.append(b"\n$EndNodes\n$Elements\n" + struct.pack("<4Q3iQ", 1, cells, 1, cells, 3, 1, 4, cells))
        for index, corners in enumerate(tetrahedra, 1):
            parts.append(struct.pack("<5Q", index, *(corner + 1 for corner in corners)))
    else:
        parts.append(f"1 {count} 1 {count}\n3 1 0 {count}\n".encode() + "".join(f"{tag}\n" for tag in tags).encode())
        parts.append("".join(f"{x} {y} {z}\n" for x, y, z in points.tolist()).encode())
        parts.append(f"$EndNodes\n$Elements\n1 {cells} 1 {cells}\n3 1 4 {cells}\n".encode())
        for index, corners in enumerate(tetrahedra, 1):
            parts.append(f"{index} {' '.join(str(corner + 1) for corner in corners)}\n".encode())
    return b"".join(parts) + b"\n$EndElements\n"


def ksplat_bytes(points: np.ndarray, level: int = 0, degree: int = 0) -> bytes:
    """A .ksplat of one section: red splats 0.1 wide, whose further harmonics count up from 1 in hundredths."""
    count, further = len(points), (0, 9, 24, 45)[degree]
    head, part = bytearray(4096), bytearray(1024)
    head[1] = 1
    struct.pack_into("<II", head, 4, 1, 1)
    struct.pack_into("<I", head, 16, count)
    struct.pack_into("<H", head, 20, level)
    struct.pack_into("<2f", head, 36, -1.5, 1.5)
    buckets = b""
    struct.pack_into("<4I", part, 0, count, count, 256, 1)
    struct.pack_into("<f", part, 16, 5.0)
    struct.pack_into("<H", part, 40, degree)
    sh = np.arange(1, further + 1) / 100.0
    if level == 0:
        rows = [struct.pack("<10f4B", *xyz, 0.1, 0.1, 0.1, 1, 0, 0, 0, 255, 0, 0, 255) for xyz in points.tolist()]
        extra = sh.astype("<f4").tobytes()
    else:
        struct.pack_into("<H", part, 20, 12)
        struct.pack_into("<I", part, 24, 32767)
        struct.pack_into("<2I", part, 32, 0, 1)
        centre = points.mean(axis=0)
        buckets = struct.pack("<I", count) + centre.astype("<f4").tobytes()
        places = np.rint((points - centre) * (32767 / 2.5) + 32767).astype(int)
        half = np.array([0.1, 0.1, 0.1, 1, 0, 0, 0], "<f2").tobytes()
        rows = [struct.pack("<3H", *place) + half + bytes([255, 0, 0, 255]) for place in places.tolist()]
        extra = sh.astype("<f2").tobytes() if level == 1 else np.rint((sh + 1.5) / 3.0 * 255).astype("u1").tobytes()
    return bytes(head) + bytes(part) + buckets + b"".join(row + extra for row in rows)


def sog_bytes(points: np.ndarray, bands: int = 0, without: str = "", **changed: object) -> bytes:
    """A .sog of red splats, half opaque, 0.1, 0.2 and 0.1 wide before they are turned by 90 degrees about z."""
    count, width = len(points), 4
    height = -(-count // width)
    logs = np.sign(points) * np.log1p(np.abs(points))
    low, high = logs.min(axis=0), logs.max(axis=0)
    steps = np.rint((logs - low) / (high - low) * 65535).astype(int)
    half = 255
    files: Mapping[str, np.ndarray] = {
        "means_l.webp": steps & 255,
        "means_u.webp": steps >> 8,
        # w is left out; x and y are 0, and z is as large as w
        "quats.webp": np.tile([128, 128, half, 252], (count, 1)),
        "scales.webp": np.tile([1, 2, 1], (count, 1)),
        "sh0.webp": np.tile([1, 0, 0, 128], (count, 1)),
    }
    meta: dict[str, object] = {
        "version": 2,
        "count": count,
        "means": {"mins": low.tolist(), "maxs": high.tolist(), "files": ["means_l.webp", "means_u.webp"]},
        "scales": {"codebook": [0.0, float(np.log(0.1)), float(np.log(0.2))], "files": ["scales.webp"]},
        "quats": {"files": ["quats.webp"]},
        "sh0": {"codebook": [-0.5 / 0.28209479177387814, 0.5 / 0.28209479177387814], "files": ["sh0.webp"]},
    }
    images = {name: _image(values, width, height) for name, values in files.items()}
    if bands:
        each = (0, 3, 8, 15)[bands]
        palette = np.zeros((1, 64 * each, 4), np.uint8)
        palette[0, each : 2 * each, :3] = 1  # the second entry
        palette[..., 3] = 255
        images["shN_centroids.webp"] = _webp(palette)
        images["shN_labels.webp"] = _image(np.tile([1, 0, 0], (count, 1)), width, height)
        meta["shN"] = {
            "count": 2,
            "bands": bands,
            "codebook": [0.0, 0.25],
            "files": ["shN_centroids.webp", "shN_labels.webp"],
        }
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("meta.json", json.dumps({**meta, **changed}))
        for name, data in images.items():
            if name != without:
                archive.writestr(name, data)
    return out.getvalue()


def _image(values: np.ndarray, width: int, height: int) -> bytes:
    pixels = np.full((width * height, 4), 255, np.uint8)
    pixels[: len(values), : values.shape[1]] = values
    return _webp(pixels.reshape(height, width, 4))


def _webp(pixels: np.ndarray) -> bytes:
    out = io.BytesIO()
    Image.fromarray(pixels).save(out, "webp", lossless=True, exact=True)
    return out.getvalue()
