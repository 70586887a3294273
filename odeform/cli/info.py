"""`odeform info`."""

import argparse
import json
from typing import TYPE_CHECKING, Any

from odeform.cli.options import add_checkpoint, add_json, write_json

if TYPE_CHECKING:
    from odeform.types import Mesh

__all__ = ["HELP", "add_options", "run"]

HELP = "Print the schema, provenance and scores of a checkpoint"


def add_options(parser: argparse.ArgumentParser) -> None:
    add_checkpoint(parser)
    add_json(parser, "write the JSON to this file instead of printing it")


def describe_body(body: "Mesh") -> dict[str, Any]:
    """Vertices, size in metres, and the distance up to which another shape counts as this one: scores hold for no other
    shape."""
    from odeform.geometry.shape_similarity import compare_shapes

    size = (body.points.max(axis=0) - body.points.min(axis=0)).tolist()
    return {"vertices": len(body.points), "size_m": size, "tolerance_m": compare_shapes(body, [body]).tolerance}


def run(args: argparse.Namespace) -> None:
    from odeform.models.registry import load

    predictor = load(args.checkpoint)
    checkpoint = predictor.checkpoint
    result = {
        "schema": checkpoint.schema.to_json(),
        "model": predictor.model,
        "made_of": predictor.made_of,
        "predicts": "the final state only" if predictor.final_only else "motions",
        "size_bytes": checkpoint.size_bytes,
        "numbers": sum(int(array.size) for array in checkpoint.arrays.values()),
        "config": {key: value for key, value in checkpoint.config.items() if key != "trials"},
        "trained_shapes": [describe_body(body) for body in predictor.bodies],
        "provenance": checkpoint.provenance,
        "scores": {key: value for key, value in checkpoint.scores.items() if key != "per_frame_rmse_mm"},
        "sha256": checkpoint.sha256,
    }
    write_json(result, args.json)
    if not args.json:
        print(json.dumps(result, indent=1))
