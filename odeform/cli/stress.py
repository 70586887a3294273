"""`odeform stress`."""

import argparse
import io
from pathlib import Path

from odeform.cli.options import add_checkpoint, add_cluster, add_json, positive, write_json
from odeform.errors import FailedCheck

__all__ = ["HELP", "add_options", "run"]

HELP = "Run a model far outside its trained range and check what it returns"


def add_options(parser: argparse.ArgumentParser) -> None:
    add_checkpoint(parser, default="kick")
    parser.add_argument(
        "--cases", type=int, default=20_000, metavar="N", help="minimum number of distinct cases (default: 20000)"
    )
    parser.add_argument(
        "--draws",
        type=int,
        default=5_000,
        metavar="N",
        help="motions inside the trained box, watched to the end of the time axis; of pushed objects, pushes "
        "until they rest (default: 5000)",
    )
    parser.add_argument(
        "--map", metavar="FILE.png", help="also write a picture of where it is stable, over two parameters and time"
    )
    add_cluster(parser)
    add_json(parser)


def run(args: argparse.Namespace) -> None:
    from odeform.cluster import on_cluster
    from odeform.stress.stress import report, stress

    positive("--cases", args.cases)
    positive("--draws", args.draws)
    if args.map:
        _write_map(args.checkpoint, Path(args.map))
    with on_cluster(args.cluster):
        result = stress(args.checkpoint, args.cases, draws=args.draws)
    write_json(result, args.json)
    print(report(result))
    if failed := [name for name, check in result["checks"].items() if not check["holds"]]:
        raise FailedCheck(", ".join(failed))


def _write_map(checkpoint: str, path: Path) -> None:
    from odeform.io import atomic_write
    from odeform.models.registry import load_continuous
    from odeform.stress.stability import map_image, stability_map

    picture = io.BytesIO()
    map_image(stability_map(load_continuous(checkpoint))).save(picture, format="PNG", optimize=True)
    atomic_write(path, picture.getvalue())
