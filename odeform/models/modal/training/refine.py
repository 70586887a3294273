"""Refines the mechanical model for a body that it was not trained on, by simulated motions of that body."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.dataset.index import Dataset
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.models.modal.body_parameters import schema_of
from odeform.models.modal.loaded import ROOM
from odeform.models.modal.training.contact_fit import STEP, fit_contact_parameters, relative_errors
from odeform.models.modal.training.fit import Checkpointed, checkpoint_of, inputs_of, training_pushes, with_qualities_of
from odeform.models.modal.training.parameter_cache import ParameterCache
from odeform.models.modal.training.pushes import Pushes, read_pushes
from odeform.models.modal.training.residual_fit import fit_contact_residual
from odeform.models.modal.user_part import parts_of_item
from odeform.models.per_object import joined
from odeform.simulation.objects.soft_object import SoftObject

__all__ = ["refinements"]

SEQUENCES = 16  # to which contact parameters are fitted; there are ten of them
STARTS = 2  # trained objects from whose contact parameters a fit starts
EVALUATIONS = 8  # of the errors and their derivatives, from each start
CONTACT = 0.6  # fraction of the time that contact parameters may take
PRIOR = 0.01  # of a squared logarithm of a contact parameter, in squared relative errors
FITTED = "fitted"


def refinements(
    dataset: Dataset,
    item: SoftObject,
    starts: Mapping[str, ContactParameters],
    known: ParameterCache,
    remaining: Callable[[], float],
    seed: int,
    report: Callable[[str], None],
) -> Iterator[Checkpoint]:
    """Yields models of one body, each with more of what its motions teach: first mechanics with the contact parameters
    of the trained object that suit the motions best, then with fitted ones, then with a residual.

    Args:
        dataset: Motions of the body `item` alone.
        item: The body as it was simulated.
        starts: Contact parameters of trained objects, by name.
        known: Keeps what is fitted; an interrupted refinement goes on from there.
        remaining: Returns the fraction of the time that is left.
        seed: Seeds the choice of motions that contact parameters are fitted to.
        report: Told in words of each step.
    """
    pulse, train = dataset.fixed["pulse_s"], training_pushes(dataset, item)
    val = read_pushes(dataset, "val", train.body)
    report(f"{item.name}: {len(train.contacts)} pushes; {len(train.body.eigenvalues)} modes")

    def model(parameters: ContactParameters, residual: Checkpointed | None = None) -> Checkpoint:
        return _model(dataset, item, train, val, parameters, pulse, residual)

    def error(parameters: ContactParameters) -> float:
        total = sum(len(p.contacts) * _error(p, parameters, pulse) for p in (train, val))
        return total if np.isfinite(total) else np.inf

    before = {name: error(parameters) for name, parameters in starts.items()}
    best = sorted(before, key=lambda name: before[name])[:STARTS]
    report(f"of the trained objects, {best[0]} has the contact parameters that suit {item.name} best")
    yield model(starts[best[0]])
    fitted = known.get(FITTED)
    if fitted is None:
        fitted = _fitted(train, {name: starts[name] for name in best}, pulse, known, remaining, seed, error, report)
        if remaining() > 0.0:
            known.add(FITTED, fitted)
    yield model(fitted)
    if remaining() > 0.0:
        report("residual: regresses what the mechanics leaves unexplained")
        yield model(fitted, fit_contact_residual(train, val, fitted, pulse))


def _fitted(
    train: Pushes,
    starts: Mapping[str, ContactParameters],
    pulse: float,
    known: ParameterCache,
    remaining: Callable[[], float],
    seed: int,
    error: Callable[[ContactParameters], float],
    report: Callable[[str], None],
) -> ContactParameters:
    """The contact parameters with the smallest error, of those found from several starts within the time."""
    found: list[ContactParameters] = []
    for index, (name, start) in enumerate(starts.items()):
        # an interrupted fit goes on from the best that it had found
        begun, left = known.get(name) or start, (1.0 - CONTACT) + CONTACT * (1.0 - (index + 1) / len(starts))
        last = begun

        def needed(best: ContactParameters, name: str = name, left: float = left) -> bool:
            nonlocal last
            if best is not last and best != last:
                known.add(name, best)
                last = best
            return remaining() > left

        found.append(
            fit_contact_parameters(
                [train.some(SEQUENCES, seed + index)],
                pulse,
                begun,
                report=lambda line, name=name: report(f"from {name}: {line}"),
                evaluations=EVALUATIONS,
                prior=PRIOR,
                needed=needed,
            )
        )
    return min([*found, *starts.values()], key=error)


def _error(pushes: Pushes, parameters: ContactParameters, pulse: float) -> float:
    return float(np.square(relative_errors(pushes, pushes.predicted(parameters, pulse, STEP))).sum())


def _model(
    dataset: Dataset,
    item: SoftObject,
    train: Pushes,
    val: Pushes,
    parameters: ContactParameters,
    pulse: float,
    residual: Checkpointed | None,
) -> Checkpoint:
    schema = schema_of([item], dataset.schema)
    theta = inputs_of(dataset, "train")
    part = checkpoint_of(schema, theta, train, parameters, pulse, item.material.young, residual)
    part = with_qualities_of(part, inputs_of(dataset, "val"), val)
    arrays, config = parts_of_item(item)
    # a few motions do not say how far a body can deform: another push may go beyond all of them
    shift, deformation = part.config["largest"]
    room = ROOM * float(np.ptp(train.body.points, axis=0).max())
    config = {**config, "largest": [shift, max(deformation, room)]}
    part = replace(part, arrays={**part.arrays, **arrays}, config={**part.config, **config})
    return joined(schema, {item.name: part})
