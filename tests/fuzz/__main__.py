"""`python -m tests.fuzz --cases 20000`: damages inputs of every reader, and lists what goes wrong.

What may not happen: a traceback, more than 10 s, more than 2 GB of memory, code that runs, output that is not finite.
"""

import argparse
import contextlib
import io
import sys

from .run import case, watch_for_code
from .targets import TARGETS


def main() -> int:
    """Run the cases; the exit code is 1 if any fails."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz")
    parser.add_argument("--cases", type=int, default=20_000, metavar="N", help="number of cases (default: 20000)")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="seed of all cases (default: 0)")
    parser.add_argument("--only", default="", metavar="TEXT", help="only targets with this text in their name")
    args = parser.parse_args()
    watch_for_code()
    targets = [target for target in TARGETS if args.only in target.name]
    failures: dict[str, list[str]] = {}
    for number in range(args.cases):
        target = targets[number % len(targets)]
        with contextlib.redirect_stderr(io.StringIO()):
            wrong = case(target, args.seed, number)
        if wrong:
            place = wrong.strip().splitlines()
            key = f"{place[-1][:200]} {' '.join(line.strip() for line in place if 'odeform/' in line)[-160:]}"
            failures.setdefault(f"{target.name}: {key}", []).append(f"case {number}\n{wrong}")
    for key, found in failures.items():
        print(f"{len(found)} x {key}\n{found[0]}")
    print(f"{args.cases} cases of {len(targets)} targets, {sum(map(len, failures.values()))} failures")
    return int(bool(failures))


if __name__ == "__main__":
    sys.exit(main())
