"""Teaches a trained model a body of the user's own: from simulated motions of it to a checkpoint, within minutes."""

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from odeform.checkpoint import Checkpoint
from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.evaluation.metrics import evaluate
from odeform.io import require_writable
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.models.base import Predictor
from odeform.models.modal.model import ModalModel
from odeform.models.modal.training.parameter_cache import ParameterCache
from odeform.models.modal.training.refine import refinements
from odeform.models.modal.user_body import UserBodyPredictor, resting_body, takes_user_bodies
from odeform.models.per_object import PerObject
from odeform.models.registry import load, load_model
from odeform.schema import OBJECT
from odeform.simulation.objects.user_object import UserObject
from odeform.simulation.user_data import body_in
from odeform.training.train import print_line, scored

__all__ = ["first_guess", "first_guess_error", "refine"]

LAST = 0.9  # fraction of the minutes after which nothing new begins: the result is still scored
SPLITS = ("train", "val", "test")


def refine(
    dataset: Dataset,
    out: str | Path,
    start: str | Path,
    *,
    minutes: float = 5.0,
    sequences: int | None = None,
    seed: int = 0,
    resume: bool = False,
    report: Callable[[str], None] = print_line,
    progress: Callable[[float], None] = lambda _: None,
) -> Predictor:
    """Refine a mechanical model for the body of a data set, and write it as a checkpoint whose object is that body.

    The file `out` is written as soon as there is a model, and again whenever a better one is found, by its error on
    validation motions. So whatever ends the training, the best model so far is there.

    Args:
        dataset: A folder that `odeform simulate contact-force --geometry FILE` wrote.
        out: The checkpoint to write. `OUT.part` keeps what is fitted until the refinement has ended.
        start: The checkpoint to start from, a path or a bundled name.
        minutes: Budget of processor time.
        sequences: Train on the first n training sequences; default: all.
        seed: Seeds the choice of motions that contact parameters are fitted to.
        resume: Goes on with an interrupted refinement of which `OUT.part` is the state.
        report: Called with each line of progress; default: prints it to standard error.
        progress: Called with the fraction of the minutes that is spent.

    Returns:
        The refined predictor. `predictor.checkpoint.provenance["refined"]` has the errors before and after on test
        motions.

    Raises:
        InputError: A data set without a body of its own or without motions to train on, choose and test by; a model
            that is not mechanical; a number of minutes out of range; or a file that cannot be written.
    """
    begin = time.process_time()
    if not 0.0 < minutes < float("inf"):
        raise InputError(f"minutes: expected a positive number, got {minutes:g}")
    require_writable(Path(out))
    body, trained = _checked(dataset), load(start)
    if not takes_user_bodies(trained):
        raise InputError(f"{start}: knows its trained bodies only; expected a mechanical model, as contact-force")
    used = _shortened(dataset, sequences)
    part, found = Path(f"{out}.part"), 0
    if part.exists() and not resume:
        report(f"starts over and overwrites {part} of an interrupted refinement (--resume would continue it)")
    known = ParameterCache(part, used, seed, resume and part.exists())
    guess = first_guess(trained, body)
    least, before = first_guess_error(guess, dataset, "val"), first_guess_error(guess, dataset, "test")
    report(f"first guess: pooled RMSE {before:.3f} mm on test motions, {least:.3f} mm on validation motions")
    best: Checkpoint | None = None

    def remaining() -> float:
        spent = (time.process_time() - begin) / (60.0 * LAST * minutes)
        progress(min(spent, 1.0))
        return 1.0 - spent

    with threadpool_limits(1, "blas"):  # threads of small products wait for each other
        for candidate in refinements(used, body.item, _starts(trained), known, remaining, seed, report):
            error = evaluate(load_model(candidate), dataset, "val")["rmse_pooled_mm"]
            found += 1
            report(f"model {found}: pooled RMSE {error:.3f} mm on validation motions")
            if best is None or error < least:
                best, least = candidate, min(error, least)
                _keep(out, best, _provenance(used, str(start), before, begin))
        assert best is not None
        best = scored(replace(best, provenance=_provenance(used, str(start), before, begin)), dataset)
    refined = {**best.provenance["refined"], "test_mm": best.scores["rmse_pooled_mm"]}
    load_model(replace(best, provenance={**best.provenance, "refined": refined})).save(out)
    part.unlink(missing_ok=True)
    report(f"refined: pooled RMSE {refined['test_mm']:.3f} mm on test motions; written to {out}")
    return load(out)


def first_guess(trained: Predictor, body: UserObject) -> UserBodyPredictor:
    """What a trained model makes of a body without motions of it."""
    return UserBodyPredictor(trained, resting_body(body.item, body.like))


def first_guess_error(guess: UserBodyPredictor, dataset: Dataset, split: str) -> float:
    """mm: its pooled RMSE on motions of that body."""
    named = guess.parameters_like()
    entries = tuple(
        replace(entry, parameters={**{k: v for k, v in entry.parameters.items() if k != OBJECT}, **named})
        for entry in dataset.entries
    )
    schema = replace(dataset.schema, objects=tuple(named.values()))
    return float(evaluate(guess, replace(dataset, schema=schema, entries=entries), split)["rmse_pooled_mm"])


def _checked(dataset: Dataset) -> UserObject:
    body = body_in(dataset.root) if dataset.root.is_dir() else None
    if body is None or dataset.objects != (body.item.name,) or "pulse_s" not in dataset.fixed:
        raise InputError(
            f"{dataset.root}: expected motions of a shape of your own, as "
            "`odeform simulate contact-force --geometry FILE --out DIR` makes them"
        )
    for split in SPLITS:
        if not dataset.select(split):
            raise InputError(
                f"{dataset.root}: no motion in split {split}; expected at least ten sequences (--count 10)"
            )
    return body


def _starts(trained: Predictor) -> Mapping[str, ContactParameters]:
    if isinstance(trained, PerObject):
        parts = {name: part for name, part in trained.parts.items() if isinstance(part, ModalModel)}
        return {name: part.contact_parameters for name, part in parts.items()}
    assert isinstance(trained, ModalModel)
    return {trained.model: trained.contact_parameters}


def _shortened(dataset: Dataset, count: int | None) -> Dataset:
    """The data set with the first `count` training sequences. `InputError` where there are fewer."""
    train = dataset.select("train")
    if count is None:
        return dataset
    if not 0 < count <= len(train):
        raise InputError(f"sequences: expected 1 to {len(train)}, got {count}")
    left_out = {entry.name for entry in train[count:]}
    return replace(dataset, entries=tuple(entry for entry in dataset.entries if entry.name not in left_out))


def _provenance(dataset: Dataset, start: str, before: float, begin: float) -> dict[str, Any]:
    return {
        "command": [f"odeform train DIR --from {start} --out FILE"],
        "dataset": dataset.provenance,
        "fixed": dataset.fixed,
        "training_seconds": round(time.process_time() - begin, 1),
        "refined": {"from": start, "first_guess_mm": before, "sequences": len(dataset.select("train"))},
    }


def _keep(out: str | Path, checkpoint: Checkpoint, provenance: Mapping[str, Any]) -> None:
    load_model(replace(checkpoint, provenance=dict(provenance))).save(out)
