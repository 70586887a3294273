"""The trained body at rest, from the arrays of a checkpoint."""

from odeform.types import Arrays, Mesh

__all__ = ["rest_from"]


def rest_from(arrays: Arrays) -> Mesh:
    """The body at rest, in metres. KeyError for missing arrays, ValueError for points and faces that are no mesh."""
    mesh = Mesh(arrays["rest.points"], arrays["rest.faces"])
    points, faces = mesh.points, mesh.faces
    if points.ndim != 2 or faces.ndim != 2 or points.shape[1:] != (3,) or faces.shape[1:] != (3,) or not len(points):
        raise ValueError(f"body with points {points.shape} and faces {faces.shape}")
    if faces.dtype.kind not in "iu" or faces.min(initial=0) < 0 or faces.max(initial=0) >= len(points):
        raise ValueError("faces of the body, which refer to points that do not exist")
    return mesh
