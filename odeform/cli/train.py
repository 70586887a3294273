"""`odeform train`."""

import argparse

from odeform.cli.options import DATA, add_seed, add_window, parse_window
from odeform.errors import InputError

__all__ = ["HELP", "add_options", "run"]

MINUTES, REFINE = 30.0, 5.0
HELP = "Train a model on a data set and score it on the test split"


def add_options(parser: argparse.ArgumentParser) -> None:
    from odeform.models.names import TRAINABLE

    parser.add_argument("dataset", metavar="DATASET", help=DATA)
    parser.add_argument("--out", required=True, metavar="FILE", help="checkpoint to write")
    models = f"one of {', '.join(TRAINABLE)} (default: odeform)"
    parser.add_argument("--model", default="odeform", metavar="NAME", help=models)
    parser.add_argument(
        "--from",
        dest="start",
        metavar="CKPT",
        help="refine this mechanical model (contact-force) for the shape of DATASET, which `odeform simulate "
        "--geometry` made; takes --minutes (default: 5), --sequences, --seed and --resume",
    )
    add_window(parser, "train on")
    parser.add_argument("--every", type=int, default=1, metavar="K", help="train on every K-th frame (default: 1)")
    parser.add_argument(
        "--stagger", action="store_true", help="start every K-th frame at a different frame in each sequence"
    )
    add_seed(parser, "initial weights and batches")
    parser.add_argument(
        "--minutes",
        type=float,
        metavar="M",
        help=f"training budget in minutes of processor time, including trials (default: {MINUTES:g})",
    )
    parser.add_argument(
        "--steps", type=int, metavar="N", help="number of training steps, in place of --minutes; repeatable"
    )
    parser.add_argument(
        "--sequences", type=int, metavar="N", help="train on the first N training sequences (default: all)"
    )
    parser.add_argument(
        "--without", default="", metavar="PART,...", help="leave out parts of the model, as docs/cli.md lists them"
    )
    parser.add_argument(
        "--object", nargs="+", default=[], metavar="NAME", help="train on these objects only, of a scene with several"
    )
    parser.add_argument(
        "--resume",
        action="store_true",
        help="continue an interrupted training from FILE.part, which models with a state leave",
    )


def run(args: argparse.Namespace) -> None:
    from odeform.dataset.store import open_dataset
    from odeform.training.train import train

    if args.start is not None:
        _refine(args)
        return
    args.minutes = MINUTES if args.minutes is None else args.minutes
    dataset, window = open_dataset(args.dataset), parse_window(args.window)
    options = ("minutes", "steps", "seed", "every", "stagger", "resume", "sequences")
    chosen = {name: getattr(args, name) for name in options}
    without = [name for name in args.without.split(",") if name]
    train(dataset, args.out, args.model, window=window, without=without, objects=args.object, **chosen)


def _refine(args: argparse.Namespace) -> None:
    from odeform.dataset.store import open_dataset
    from odeform.training.refine import refine

    unused = {"--model": args.model != "odeform", "--window": args.window, "--every": args.every != 1}
    unused |= {"--stagger": args.stagger, "--steps": args.steps, "--without": args.without, "--object": args.object}
    for option, given in unused.items():
        if given:
            raise InputError(
                f"{option}: not with --from, which refines a mechanical model for the one shape of DATASET"
            )
    minutes = REFINE if args.minutes is None else args.minutes
    options = {name: getattr(args, name) for name in ("sequences", "seed", "resume")}
    refine(open_dataset(args.dataset), args.out, args.start, minutes=minutes, **options)
