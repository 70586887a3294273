"""`odeform retrain`."""

import argparse
import shlex
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from odeform.cli import train as training
from odeform.cli.options import add_json, positive, write_json
from odeform.errors import InputError

if TYPE_CHECKING:
    from odeform.checkpoint import Checkpoint
    from odeform.models.base import Predictor

__all__ = ["HELP", "add_options", "run"]

HELP = "Train bundled checkpoints again by their recorded commands, and compare the scores"
AGAIN = ("continuation", "qualities", "storage")  # what `--only` makes again
SCORES = ("rmse_pooled_mm", "deformation_relative")


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "checkpoints", nargs="*", metavar="NAME", help="bundled checkpoints, SCENE or SCENE/MODEL (default: all)"
    )
    parser.add_argument("--keep", required=True, metavar="DIR", help="folder of the new ones; what it holds is kept")
    parser.add_argument(
        "--steps", type=int, metavar="N", help="steps of those that take steps, in place of the recorded budget"
    )
    parser.add_argument(
        "--only",
        choices=AGAIN,
        help="keep the models, and fit again what continues their motions beyond the trained window, measure again "
        "the solver settings of pushed objects, or store classical baselines as a training does today",
    )
    add_json(parser)


def run(args: argparse.Namespace) -> None:
    from odeform.checkpoint import bundled_checkpoints
    from odeform.models.registry import load

    if args.steps is not None:
        positive("--steps", args.steps)
        if args.only:
            raise InputError("--steps: only training takes steps")
    bundled = list(bundled_checkpoints())
    names = [name if "/" in name else f"{name}/odeform" for name in args.checkpoints] or bundled
    if unknown := [name for name in names if name not in bundled]:
        raise InputError(f"{', '.join(unknown)}: expected bundled checkpoints, {', '.join(bundled)}")
    folder = Path(args.keep)
    folder.mkdir(parents=True, exist_ok=True)
    found: dict[str, Any] = {}
    if args.only and not args.checkpoints:
        names = [name for name in bundled if _has(args.only, load(name))]
    for name in names:
        out = folder / f"{name.replace('/', '_')}.safetensors"
        recorded = load(name).checkpoint
        if args.only:
            shown = f"odeform retrain {name} --only {args.only}"
            if not out.exists():
                _make_again(args.only, name, recorded, out, shown)
        else:
            command = _command(name, recorded.provenance, out, args.steps)
            if not out.exists():
                parser = argparse.ArgumentParser()
                training.add_options(parser)
                training.run(parser.parse_args(command))
            shown = " ".join(["odeform train", *command])
        again = load(out).checkpoint
        found[name] = {"command": shown, "recorded": _scores(recorded.scores), "again": _scores(again.scores)}
        print(_line(name, found[name]))
    write_json(found, args.json)


def _command(name: str, provenance: dict[str, Any], out: Path, steps: int | None) -> list[str]:
    """Arguments of `odeform train`: as recorded, on the bundled data of the scene."""
    recorded = provenance.get("command")
    if not recorded:
        raise InputError(f"{name}: its checkpoint does not record how it was trained")
    tokens = shlex.split(recorded[-1])[2:]
    tokens = [{"DIR": name.split("/")[0], "FILE": str(out)}.get(token, token) for token in tokens]
    budget = next((option for option in ("--steps", "--minutes") if option in tokens), None)
    if steps is not None and budget is not None:
        at = tokens.index(budget)
        tokens[at : at + 2] = ["--steps", str(steps)]
    return tokens


def _has(what: str, model: "Predictor") -> bool:
    """Whether a bundled model has what `--only` makes again."""
    from odeform.models.training.continuation import is_continued
    from odeform_figures.storage import is_stored_in_full

    if what == "storage":
        return is_stored_in_full(model.checkpoint)
    return is_continued(model) if what == "continuation" else model.model == "modal"


def _make_again(what: str, name: str, recorded: "Checkpoint", out: Path, command: str) -> None:
    """Write the bundled checkpoint of this name with another of `AGAIN`."""
    from odeform.checkpoint import write_checkpoint
    from odeform.dataset.store import open_dataset
    from odeform.evaluation.metrics import evaluate
    from odeform.models.modal.training.fit import with_measured_qualities
    from odeform.models.registry import load_model
    from odeform.training.train import scored
    from odeform_figures.continuation import refitted
    from odeform_figures.storage import stored_in_steps

    known = {**recorded.provenance, what: {"command": command, "versions": {"odeform": version("odeform")}}}
    checkpoint, dataset = replace(recorded, provenance=known), open_dataset(name.split("/")[0])
    if what == "continuation":
        write_checkpoint(out, refitted(checkpoint, dataset))
    elif what == "storage":
        stored = stored_in_steps(checkpoint)
        write_checkpoint(out, replace(stored, scores=evaluate(load_model(stored), dataset, "test")))
    else:
        # other steps make other errors
        write_checkpoint(out, scored(with_measured_qualities(load_model(checkpoint), dataset), dataset))


def _scores(scores: dict[str, Any] | None) -> dict[str, float]:
    means = (scores or {}).get("mean_of_objects") or scores or {}
    return {key: float(means[key]) for key in SCORES if key in means}


def _line(name: str, found: dict[str, Any]) -> str:
    before, after = (found[which].get(SCORES[0]) for which in ("recorded", "again"))
    if before is None or after is None:
        return f"{name}: not scored"
    return f"{name}: {after:.4g} mm pooled RMSE, recorded {before:.4g} mm ({100.0 * (after / before - 1.0):+.2f} %)"
