"""Where a column comes from, in plain values: enough to make it again elsewhere, and to notice that it is another."""

from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from odeform.checkpoint import bundled_checkpoints, resolve_checkpoint
from odeform.dataset.folder import INDEX
from odeform.types import GaussianSplats, Geometry, Mesh
from odeform_viz.columns import Column
from odeform_viz.fitting import fit_to_json

__all__ = ["origin_of", "provenance_of", "versions"]


def versions() -> dict[str, str]:
    """What computes and what draws, by package. None is imported for it."""
    found = {}
    for package in ("odeform", "numpy", "scipy", "torch", "rerun-sdk", "viser"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:  # a clone on the path
            found[package] = "unknown"
    return found


def provenance_of(column: Column) -> dict[str, Any]:
    """Model or truth, origin, shape and fit. Files are named by their whole path, what is bundled by its name."""
    truth = column.truth
    common = {
        "label": column.label,
        "origin": origin_of(column),
        "pinned": None if column.pinned is None else dict(column.pinned),
        "geometry": _kind(column.geometry),
        "shape": column.fit and fit_to_json(column.fit),
    }
    if truth is not None:
        return {**common, "truth": True, "parameters": dict(truth.parameters)}
    assert column.predictor is not None
    checkpoint = column.predictor.checkpoint
    return {
        **common,
        "truth": False,
        "model": checkpoint.model,
        "sha256": checkpoint.sha256,
        "schema": checkpoint.schema.to_json(),
        "provenance": checkpoint.provenance,
        "scores": {k: v for k, v in checkpoint.scores.items() if k != "per_frame_rmse_mm"},
    }


def _kind(geometry: Geometry) -> str:
    return "mesh" if isinstance(geometry, Mesh) else "splats" if isinstance(geometry, GaussianSplats) else "points"


def origin_of(column: Column) -> str:
    """The checkpoint or the DATASET/NAME of a column: bundled ones by name, others by their whole path."""
    if not column.origin:
        return ""
    if column.truth is None:
        bundled = resolve_checkpoint(column.origin) in bundled_checkpoints().values()
        return column.origin if bundled else str(Path(column.origin).resolve())
    root, _, name = column.origin.rpartition("/")
    place = Path(root)
    here = place.is_file() or (place / INDEX).exists()
    return f"{place.resolve()}/{name}" if here else column.origin
