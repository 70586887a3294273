"""`python -m odeform_figures.motions KIND --out DIR` writes a data set of mesh frames."""

import argparse
import sys
from pathlib import Path

from odeform_figures.motions.folder import write_folder
from odeform_figures.motions.registry import KINDS


def main() -> None:
    kinds = "; ".join(f"{name}: {kind.description}" for name, kind in KINDS.items())
    parser = argparse.ArgumentParser("python -m odeform_figures.motions", description=f"Mesh frames of {kinds}")
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("--out", required=True, metavar="DIR", help="new folder")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the parameters (default: 0)")
    args = parser.parse_args()
    if Path(args.out).exists():
        parser.error(f"--out {args.out}: exists")
    write_folder(KINDS[args.kind], Path(args.out), args.seed, lambda line: print(line, file=sys.stderr))


if __name__ == "__main__":
    main()
