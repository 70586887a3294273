"""`odeform pack`."""

import argparse
from pathlib import Path

from odeform.cli.options import DATA
from odeform.errors import InputError

__all__ = ["HELP", "add_options", "run"]

HELP = "Write a small, compressed copy of a data set"


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("dataset", metavar="DATASET", help=DATA)
    parser.add_argument("--out", required=True, metavar="FILE", help="file to write, ending in .odp")
    parser.add_argument(
        "--tolerance",
        type=float,
        default=0.02,
        metavar="MM",
        help="largest error of a vertex in millimetres (default: 0.02)",
    )


def run(args: argparse.Namespace) -> None:
    from odeform.dataset.packed import SUFFIX, pack
    from odeform.dataset.store import open_dataset

    out = Path(args.out)
    if out.suffix != SUFFIX:
        raise InputError(f"--out: expected a name ending in {SUFFIX}, got {args.out!r}")
    took = pack(open_dataset(args.dataset), out, 1e-3 * args.tolerance)
    modes = "/".join(str(body["modes"]) for body in took["bodies"].values())
    rmse, worst, vertex = (1e3 * took[key] for key in ("rmse_m", "largest_rmse_m", "largest_error_m"))
    print(
        f"{out}: {out.stat().st_size / 1e6:.2f} MB, {modes} modes, RMSE {rmse:.4f} mm, of a sequence at most "
        f"{worst:.4f} mm, error of a vertex at most {vertex:.3f} mm"
    )
