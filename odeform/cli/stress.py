"""`odeform stress`."""

import argparse
import io
from pathlib import Path

from odeform.cli.options import add_checkpoint, add_json, positive, write_json

__all__ = ["HELP", "add_options", "run"]

HELP = "Run a model far outside its trained range and check what it returns"


def add_options(parser: argparse.ArgumentParser) -> None:
    add_checkpoint(parser, default="kick")
    parser.add_argument(
        "--cases", type=int, default=20_000, metavar="N", help="minimum number of distinct cases (default: 20000)"
    )
    parser.add_argument(
        "--map", metavar="FILE.png", help="also write a picture of where it is stable, over two parameters and time"
    )
    add_json(parser)


def run(args: argparse.Namespace) -> None:
    from odeform.stress.stress import report, stress

    positive("--cases", args.cases)
    if args.map:
        _write_map(args.checkpoint, Path(args.map))
    result = stress(args.checkpoint, args.cases)
    write_json(result, args.json)
    print(report(result))


def _write_map(checkpoint: str, path: Path) -> None:
    from odeform.io import atomic_write
    from odeform.models.registry import load_continuous
    from odeform.stress.stability import map_image, stability_map

    picture = io.BytesIO()
    map_image(stability_map(load_continuous(checkpoint))).save(picture, format="PNG", optimize=True)
    atomic_write(path, picture.getvalue())
