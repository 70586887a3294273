"""Files of VTK as text, written for tests."""

import base64
import lzma
import struct
import zlib

import numpy as np

__all__ = ["legacy", "polydata", "unstructured"]

Rows = np.ndarray | list[list[float]]


def legacy(points: Rows, faces: Rows, vectors: dict[str, Rows] | None = None, binary: bool = False) -> bytes:
    """A `.vtk` file of polygons, with fields of vectors at the points."""
    points, faces = np.asarray(points, float), np.asarray(faces, int)

    def block(values: np.ndarray, kind: str) -> bytes:
        if binary:
            return values.astype(kind).tobytes() + b"\n"
        return " ".join(f"{value:.9g}" for value in values.ravel()).encode() + b"\n"

    cells = np.column_stack([np.full(len(faces), faces.shape[1]), faces])
    out = (
        b"# vtk DataFile Version 3.0\nmade by a test\n" + (b"BINARY" if binary else b"ASCII") + b"\nDATASET POLYDATA\n"
    )
    out += b"POINTS %d float\n" % len(points) + block(points, ">f4")
    out += b"POLYGONS %d %d\n" % (len(cells), cells.size) + block(cells, ">i4")
    if vectors:
        out += b"POINT_DATA %d\n" % len(points)
        for name, values in vectors.items():
            out += f"VECTORS {name} float\n".encode() + block(np.asarray(values, float), ">f4")
    return out


def polydata(points: Rows, faces: Rows, form: str = "ascii") -> bytes:
    """A `.vtp` file; `form` is ascii, binary, zlib, lzma or raw (appended)."""
    return _xml("PolyData", np.asarray(points, "<f4"), "Polys", np.asarray(faces), None, {}, form)


def unstructured(
    points: Rows, cells: Rows, kind: int, vectors: dict[str, Rows] | None = None, form: str = "ascii"
) -> bytes:
    """A `.vtu` file of cells of one kind, as numbered by VTK."""
    types = np.full(len(cells), kind, "<u1")
    return _xml("UnstructuredGrid", np.asarray(points, "<f4"), "Cells", np.asarray(cells), types, vectors or {}, form)


def _xml(
    kind: str,
    points: np.ndarray,
    group: str,
    cells: np.ndarray,
    types: np.ndarray | None,
    vectors: dict[str, Rows],
    form: str,
) -> bytes:
    appended = bytearray()

    def array(name: str, values: np.ndarray) -> str:
        code = {"<f4": "Float32", "<i8": "Int64", "|u1": "UInt8"}[values.dtype.str]
        head = (
            f'<DataArray type="{code}" Name="{name}" NumberOfComponents="{values.shape[1] if values.ndim > 1 else 1}"'
        )
        data = values.tobytes()
        if form == "ascii":
            return f'{head} format="ascii">{" ".join(map(str, values.ravel().tolist()))}</DataArray>'
        if form == "raw":
            offset = len(appended)
            appended.extend(struct.pack("<I", len(data)) + data)
            return f'{head} format="appended" offset="{offset}"/>'
        if form == "binary":
            text = base64.b64encode(struct.pack("<I", len(data)) + data)
        else:
            packed = (zlib if form == "zlib" else lzma).compress(data)
            header = struct.pack("<4I", 1, len(data), 0, len(packed))
            text = base64.b64encode(header) + base64.b64encode(packed)
        return f'{head} format="binary">{text.decode()}</DataArray>'

    lists = [array("connectivity", cells.ravel().astype("<i8"))]
    lists.append(array("offsets", cells.shape[1] * np.arange(1, len(cells) + 1).astype("<i8")))
    if types is not None:
        lists.append(array("types", types))
    fields = "".join(array(name, np.asarray(values, "<f4")) for name, values in vectors.items())
    packer = {"zlib": "ZLib", "lzma": "LZMA"}.get(form)
    compressor = f' compressor="vtk{packer}DataCompressor"' if packer else ""
    counted = "NumberOfCells" if types is not None else "NumberOfPolys"
    count = f'NumberOfPoints="{len(points)}" {counted}="{len(cells)}"'
    text = (
        f'<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt32"{compressor}><{kind}>'
        f"<Piece {count}><PointData>{fields}</PointData><Points>{array('Points', points)}</Points>"
        f"<{group}>{''.join(lists)}</{group}></Piece></{kind}>"
    ).encode()
    if form == "raw":
        text += b'<AppendedData encoding="raw">_' + bytes(appended) + b"</AppendedData>"
    return text + b"</VTKFile>"
