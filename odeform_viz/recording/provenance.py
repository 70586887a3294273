"""Tells where a column comes from, in plain values that suffice to load it again and to notice a change."""

from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from odeform.checkpoint import bundled_checkpoints, resolve_checkpoint
from odeform.dataset.folder import INDEX
from odeform.models.modal.user_body import UserBodyPredictor
from odeform.motion.base import Motion
from odeform.types import GaussianSplats, Geometry, Mesh
from odeform_viz.columns import Column
from odeform_viz.fitting import fit_to_json

__all__ = ["origin_of", "provenance_of", "versions"]


def versions() -> dict[str, str]:
    """The versions of the packages that compute and draw. None of them is imported."""
    found = {}
    for package in ("odeform", "numpy", "scipy", "torch", "rerun-sdk", "viser"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:  # a clone on the path, not installed
            found[package] = "unknown"
    return found


def provenance_of(column: Column) -> dict[str, Any]:
    """Label, origin, pinned parameters and shape of a column; its model's checkpoint, or the truth's parameters.

    `own_body` says whether a mechanical model has made a body of the shape. `likeness` says how far the shape is from
    the trained body, in metres, and `distance` how far that body is, relative to its size; the scores are those of the
    trained body, and left out for other shapes.
    """
    truth = column.truth
    user_model = column.predictor if isinstance(column.predictor, UserBodyPredictor) else None
    common = {
        "label": column.label,
        "origin": origin_of(column),
        "pinned": None if column.pinned is None else dict(column.pinned),
        "geometry": _kind(column.geometry),
        "shape": column.fit and fit_to_json(column.fit),
        "own_body": user_model is not None,
        "distance": user_model and user_model.distance,
    }
    if truth is not None:
        return {**common, "truth": True, "parameters": dict(truth.parameters)}
    if isinstance(column.source, Motion):
        return {**common, "truth": False, "parameters": dict(column.source.parameters)}
    assert column.predictor is not None
    checkpoint = column.predictor.checkpoint
    similarity = column.predictor.validity.similarity(column.geometry)
    untrained = similarity is not None and not similarity.same
    scores = {} if untrained else {k: v for k, v in checkpoint.scores.items() if k != "per_frame_rmse_mm"}
    return {
        **common,
        "truth": False,
        "model": checkpoint.model,
        "sha256": checkpoint.sha256,
        "schema": checkpoint.schema.to_json(),
        "provenance": checkpoint.provenance,
        "scores": scores,
        "likeness": similarity and {"trained": similarity.same, **asdict(similarity)},
    }


def _kind(geometry: Geometry) -> str:
    return "mesh" if isinstance(geometry, Mesh) else "splats" if isinstance(geometry, GaussianSplats) else "points"


def origin_of(column: Column) -> str:
    """The checkpoint or DATASET/NAME of a column: by name if bundled, else by absolute path; empty if there is none."""
    if not column.origin:
        return ""
    if column.truth is None:
        bundled = resolve_checkpoint(column.origin) in bundled_checkpoints().values()
        return column.origin if bundled else str(Path(column.origin).resolve())
    root, _, name = column.origin.rpartition("/")
    folder = Path(root)
    local = folder.is_file() or (folder / INDEX).exists()
    return f"{folder.resolve()}/{name}" if local else column.origin
