"""`odeform info`."""

import argparse
import json

from odeform.cli.options import add_checkpoint, add_json, write_json

__all__ = ["HELP", "add_options", "run"]

HELP = "Print the schema, provenance and scores of a checkpoint"


def add_options(parser: argparse.ArgumentParser) -> None:
    add_checkpoint(parser)
    add_json(parser, "write the JSON to this file instead of printing it")


def run(args: argparse.Namespace) -> None:
    from odeform.models.registry import open_checkpoint

    checkpoint = open_checkpoint(args.checkpoint)
    result = {
        "schema": checkpoint.schema.to_json(),
        "model": checkpoint.model,
        "size_bytes": checkpoint.size_bytes,
        "numbers": sum(int(array.size) for array in checkpoint.arrays.values()),
        "config": {key: value for key, value in checkpoint.config.items() if key != "trials"},
        "provenance": checkpoint.provenance,
        "scores": {key: value for key, value in checkpoint.scores.items() if key != "per_frame_rmse_mm"},
        "sha256": checkpoint.sha256,
    }
    write_json(result, args.json)
    if not args.json:
        print(json.dumps(result, indent=1))
