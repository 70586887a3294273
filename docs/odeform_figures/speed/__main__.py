"""Start-up times, and what fewer modes or points would save: `python -m odeform_figures.speed CKPT`."""

import argparse
from collections.abc import Sequence

from odeform.benchmark.timing import as_viewed
from odeform.cli import run_guarded
from odeform.models.registry import load_reduced
from odeform_figures.output import write_or_print
from odeform_figures.speed.ablations import ablations
from odeform_figures.speed.startup import startup

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Measure one checkpoint, and print JSON or write it to a file; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.speed", description=__doc__)
    parser.add_argument("checkpoint", metavar="CKPT", help="a model of reduced coordinates, as of `odeform bench`")
    parser.add_argument("--json", metavar="FILE", help="write the result to this file instead of printing it")
    args = parser.parse_args(argv)

    def measure() -> None:
        predictor = load_reduced(args.checkpoint)
        with as_viewed():
            result = {"startup": startup(args.checkpoint), "ablations": ablations(predictor)}
        write_or_print(result, args.json)

    return run_guarded(measure)


if __name__ == "__main__":
    raise SystemExit(main())
