"""What becomes of hard shapes: `python -m odeform_figures.studies.scans [--bad] [FILE ...] [--json FILE]`.

Without files, the shapes that the project makes by code (`odeform_figures.bodies.hard`). Each is made a body, and
pushed, in a process of its own: seconds of the processor without the start of the process, and the most memory that it
took.
"""

import argparse
import json
import multiprocessing
import resource
import sys
import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from odeform.errors import InputError

__all__ = ["main", "outcome"]

LIMIT = 300.0  # s for one shape
MOMENTS = np.linspace(0.0, 1.0, 21)  # s


def outcome(name: str, kind: str) -> dict[str, Any]:
    """What becomes of one shape: a path for the kind "file", else a name of `odeform_figures.bodies.hard`."""
    from odeform.models.modal.user_body import UserBodyPredictor, user_body
    from odeform.models.registry import load
    from odeform_figures.bodies.hard import BAD, HARD
    from odeform_viz.fitting import readable_shape

    trained = load("contact-force")
    geometry = None if kind == "file" else (HARD | BAD)[name]()
    begin, spent = time.perf_counter(), time.process_time()
    found: dict[str, Any] = {"name": Path(name).name if kind == "file" else name}
    try:
        geometry = readable_shape(name)[0] if geometry is None else geometry
        body = user_body(geometry, Path(name).stem)
        found["body_s"] = round(time.perf_counter() - begin, 2)
        moved = UserBodyPredictor(trained, body).solve(body.fit.geometry)
        places = moved.vertices(MOMENTS)
        found |= {"said": body.made, "like": body.like, "nodes": len(body.item.points)}
        found |= {"finite": bool(np.isfinite(places).all()), "status": moved.status}
        found["moved_mm"] = round(1e3 * float(np.linalg.norm(places - places[0], axis=2).max()), 1)
    except InputError as error:
        found["refused"] = str(error)
    found["processor_s"] = round(time.process_time() - spent, 2)
    found["seconds"] = round(time.perf_counter() - begin, 2)
    found["memory_mb"] = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    return found


def _answer(outbox: Connection, name: str, kind: str) -> None:
    outbox.send(outcome(name, kind))


def _guarded(name: str, kind: str) -> dict[str, Any]:
    """The outcome, from a process of its own."""
    context = multiprocessing.get_context("spawn")
    inbox, outbox = context.Pipe(duplex=False)
    process = context.Process(target=_answer, args=(outbox, name, kind))
    process.start()
    outbox.close()
    try:
        found = inbox.recv() if inbox.poll(LIMIT) else {"name": name, "failed": f"not done in {LIMIT:g} s"}
    except EOFError:
        found = {"name": name, "failed": "the process ended"}
    process.terminate()
    process.join()
    return found


def _line(found: dict[str, Any]) -> str:
    if "failed" in found:
        return f"| {found['name']} | **failed** | {found['failed']} | | |"
    stands = "refused" not in found
    became = f"moves {found['moved_mm']:g} mm" if stands else "refused"
    if stands and not found["finite"]:
        became = "**not finite**"
    said = found["said"] if stands else found["refused"]
    return f"| {found['name']} | {became} | {said} | {found['processor_s']:.1f} s | {found['memory_mb']} MB |"


def main() -> int:
    """Print the table; returns the exit code."""
    from odeform_figures.bodies.hard import BAD, HARD

    parser = argparse.ArgumentParser(prog="python -m odeform_figures.studies.scans", description=__doc__)
    parser.add_argument("files", nargs="*", metavar="FILE", help="meshes, points or splats (default: shapes by code)")
    parser.add_argument("--bad", action="store_true", help="those that are no body")
    parser.add_argument("--only", metavar="TEXT", default="", help="those with this text in their names")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write figures to this file")
    given = parser.parse_args()
    names = given.files or list(BAD if given.bad else HARD)
    rows = []
    for name in names:
        if given.only in name:
            rows.append(_guarded(name, "file" if given.files else "code"))
            print(_line(rows[-1]), flush=True)
    stand = sum(row.get("finite", False) for row in rows)
    print(f"{stand} of {len(rows)} stand and move", file=sys.stderr)
    if given.json:
        given.json.write_text(json.dumps(rows, indent=1))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
