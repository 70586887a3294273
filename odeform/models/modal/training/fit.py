"""The training of the mechanical model: contact parameters for all bodies of a data set, then for each."""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.dataset.index import Dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.errors import InputError
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.models.base import Predictor
from odeform.models.modal.body_parameters import schema_of
from odeform.models.modal.elastic_body import elastic_body
from odeform.models.modal.model import EXACT, QUALITIES, ModalModel
from odeform.models.modal.training import contact_fit
from odeform.models.modal.training.contact_fit import FINE, described, fit_contact_parameters, relative_errors
from odeform.models.modal.training.parameter_cache import SHARED, ParameterCache
from odeform.models.modal.training.pushes import Pushes, read_pushes
from odeform.models.modal.training.residual_fit import fit_contact_residual
from odeform.models.per_object import PerObject, joined
from odeform.models.training.qualities import Validation, with_qualities
from odeform.models.training.run import Run
from odeform.motion.reduced_space import POSE
from odeform.parallel import as_completed
from odeform.progress import Progress
from odeform.schema import Schema
from odeform.simulation.objects.catalog import OBJECTS, get_object
from odeform.simulation.objects.soft_object import SoftObject
from odeform.solver.integrate import SolverSettings
from odeform.types import Arrays, Floats

__all__ = [
    "checkpoint_of",
    "fit_mechanical",
    "inputs_of",
    "train_modal",
    "training_pushes",
    "with_measured_qualities",
    "with_qualities_of",
]

SEQUENCES = 8  # of each body, to which the contact parameters that all share are fitted; it has ten numbers
BODY_SEQUENCES, DRAWS = 32, 2  # to which those of one body are, and how many such draws; the best are kept
FIXED = {"pulse_s", "projectile_radius_m", "projectile_mass_kg"}
MODES, LEFT_OUT = (120, 400), 0.15  # the second number of modes where the first leaves out more of the deformation
Checkpointed = tuple[Arrays, dict[str, Any]]
TOLERANCES = (7e-4, 6e-4, 5e-4, 4e-4, 3.5e-4, 3e-4, 2.5e-4, 2e-4, 1.8e-4, 1.5e-4, 1.2e-4, 1e-4, 8e-5, 6e-5, 4e-5)
"""m, tried for each body."""
SOLVER_FRACTIONS = {"draft": (1.0, 1.0), "balanced": (0.15, 0.3)}
"""Fractions of the model's errors, as `odeform.models.training.qualities.FRACTIONS`: this adds one per cent to the
total error."""


def train_modal(run: Run) -> Checkpoint:
    """Train on the objects of the data of `run`, up to the last frame asked for; see `fit_mechanical`.

    `InputError` for frames that are left out, and a number of steps.
    """
    request, dataset = run.request, run.dataset
    if request.every > 1 or request.stagger or request.steps is not None:
        raise InputError("modal: expected no --every, --stagger or --steps")
    window = dataset.schema.window
    last = (FrameSubsampling(request.window).count(dataset.schema) - 1) / window.rate
    dataset = replace(dataset, schema=replace(dataset.schema, window=replace(window, stop=last)))
    known_parameters = ParameterCache(run.part, dataset, request.seed, request.resume)
    return fit_mechanical(dataset, known_parameters, request.seed, run.report, "residual" not in request.without)


def fit_mechanical(
    dataset: Dataset,
    known_parameters: ParameterCache,
    seed: int,
    report: Callable[[str], None],
    with_residual: bool = True,
) -> Checkpoint:
    """Train on the objects of a data set of the scene `contact-force`; contact parameters that are finished are kept in
    `known_parameters`, and those that it has are not fitted again.

    Without `with_residual`, motions are those of the mechanics alone. `InputError` for other data.
    """
    _require_objects(dataset)
    begin, pulse = time.process_time(), dataset.fixed["pulse_s"]
    each = {name: _read_pushes(dataset, name, report) for name in dataset.objects}
    shared = known_parameters.get(SHARED)
    if shared is None:
        some = [pushes.some(SEQUENCES, seed) for pushes in each.values()]
        shared = fit_contact_parameters(some, pulse, ContactParameters(), report=report)
        known_parameters.add(SHARED, shared)
    bodies = [
        _Body(
            schema_of([get_object(name)], dataset.of(name).schema),
            {split: inputs_of(dataset.of(name), split) for split in ("train", "val")},
            pushes,
            read_pushes(dataset.of(name), "val", pushes.body),
            shared,
            known_parameters.get(name),
            pulse,
            get_object(name).material.young,
            seed,
            contact_fit.EVALUATIONS,
            with_residual,
        )
        for name, pushes in each.items()
    ]
    found: dict[str, Checkpoint] = {}
    spent, names = time.process_time() - begin, list(each)
    progress = Progress("bodies", len(bodies))
    for index, (contact_parameters, part, seconds) in as_completed(_fitted, bodies):
        name, spent = names[index], spent + seconds
        known_parameters.add(name, contact_parameters)
        found[name] = part
        report(f"{name}: {described(contact_parameters)}")
        progress.advance(note=name)
    progress.close()
    items = [get_object(name) for name in names]
    whole = joined(schema_of(items, dataset.schema), {name: found[name] for name in names})
    return replace(whole, config={**whole.config, "val": {"seconds": spent}})


def _require_objects(dataset: Dataset) -> None:
    missing = [name for name in dataset.objects if name not in OBJECTS]
    if missing or not dataset.objects or not set(dataset.fixed) >= FIXED:
        raise InputError(
            f"{dataset.root}: expected data of scene contact-force, of objects {', '.join(OBJECTS)}; "
            f"got scene {dataset.schema.scene}"
        )


def _read_pushes(dataset: Dataset, name: str, report: Callable[[str], None]) -> Pushes:
    pushes = training_pushes(dataset.of(name), get_object(name))
    report(
        f"{name}: {len(pushes.contacts)} pushes; {len(pushes.body.eigenvalues)} modes leave out "
        f"{100.0 * pushes.fraction_left_out:.0f} % of the deformation"
    )
    return pushes


def inputs_of(dataset: Dataset, split: str) -> Floats:
    """(S, P) in [-1, 1]."""
    return np.array([dataset.schema.vector(entry.parameters) for entry in dataset.select(split)])


@dataclass(frozen=True, eq=False)
class _Body:
    """Holds what the fit of one body needs."""

    schema: Schema
    theta: dict[str, Floats]
    """(S, P) inputs by split."""
    train: Pushes
    val: Pushes
    shared: ContactParameters
    known: ContactParameters | None
    """Its contact parameters, if an interrupted training has finished them."""
    pulse: float
    young: float
    """Pa."""
    seed: int
    evaluations: int
    with_residual: bool


def _fitted(body: _Body) -> tuple[ContactParameters, Checkpoint, float]:
    """Its contact parameters, its checkpoint, and the seconds of processor time that they took."""
    begin = time.process_time()
    contact_parameters = _contact_parameters(body) if body.known is None else body.known
    residual = (
        fit_contact_residual(body.train, body.val, contact_parameters, body.pulse) if body.with_residual else None
    )
    checkpoint = checkpoint_of(
        body.schema, body.theta["train"], body.train, contact_parameters, body.pulse, body.young, residual
    )
    checkpoint = with_qualities_of(checkpoint, body.theta["val"], body.val)
    return contact_parameters, checkpoint, time.process_time() - begin


def with_qualities_of(checkpoint: Checkpoint, theta: Floats, val: Pushes) -> Checkpoint:
    """Chooses solver settings for the body of a checkpoint, by validation pushes of inputs `theta` (S, P).

    Each body has its own: what a solver error does to a motion depends on it.
    """
    known = Validation(theta, val.times, val.reduced, np.ones(val.reduced.shape[:2], dtype=bool))
    candidates = [SolverSettings("limex", tolerance=tolerance, dtype="float64") for tolerance in TOLERANCES]
    return with_qualities(checkpoint, known, EXACT, [*candidates, QUALITIES["reference"]], SOLVER_FRACTIONS)


def with_measured_qualities(model: Predictor, dataset: Dataset) -> Checkpoint:
    """The checkpoint of a trained mechanical model, with solver settings that are chosen again on validation motions.

    The model stays as it is. `InputError` for other models.
    """
    parts = model.parts.items() if isinstance(model, PerObject) else ()
    asked = [
        (part.checkpoint, inputs_of(dataset.of(name), "val"), read_pushes(dataset.of(name), "val", part.body))
        for name, part in parts
        if isinstance(part, ModalModel)
    ]
    if not asked:
        raise InputError(f"{model.model}: expected a mechanical model, of pushed objects")
    objects = dict(model.checkpoint.config["objects"])
    for index, found in as_completed(_measured, asked):
        name = model.schema.objects[index]
        objects[name] = {**found.config, "schema": objects[name]["schema"]}
    return replace(model.checkpoint, config={**model.checkpoint.config, "objects": objects})


def _measured(asked: tuple[Checkpoint, Floats, Pushes]) -> Checkpoint:
    return with_qualities_of(*asked)


def _contact_parameters(body: _Body) -> ContactParameters:
    """Chooses, of those of all bodies and of its own, fitted to several draws of its motions, the one with the smallest
    error on all training and validation motions.

    Friction and damping of the simulator depend on how mass and vertices are spread in a body. Where a sphere slips off
    or not, errors jump with the contact parameters, and a fit ends in one of many minima.
    """
    draws = (body.train.some(BODY_SEQUENCES, body.seed + index) for index in range(DRAWS))
    own = [
        fit_contact_parameters([some], body.pulse, body.shared, report=lambda _: None, evaluations=2 * body.evaluations)
        for some in draws
    ]

    def error(contact_parameters: ContactParameters) -> float:
        total = 0.0
        for pushes in (body.train, body.val):
            errors = relative_errors(pushes, pushes.predicted(contact_parameters, body.pulse, FINE))
            total += len(pushes.contacts) * float(np.square(errors).sum())
        return total if np.isfinite(total) else np.inf

    return min([*own, body.shared], key=error)


def training_pushes(dataset: Dataset, item: SoftObject) -> Pushes:
    """Reads the training motions of one object, with as many modes as they ask for."""
    few, many = MODES
    pushes = read_pushes(dataset, "train", elastic_body(item, few))
    if pushes.fraction_left_out <= LEFT_OUT:
        return pushes
    return read_pushes(dataset, "train", elastic_body(item, many))


def checkpoint_of(
    schema: Schema,
    theta: Floats,
    pushes: Pushes,
    contact_parameters: ContactParameters,
    pulse: float,
    young: float,
    residual: Checkpointed | None = None,
) -> Checkpoint:
    """Makes the checkpoint of one body of Young's modulus `young` Pa, trained on `pushes` with inputs `theta` (S,
    P)."""
    body = pushes.body
    largest = [np.linalg.norm(pushes.reduced[..., part], axis=-1).max() for part in (slice(0, 3), slice(POSE, None))]
    return Checkpoint(
        model=ModalModel.model,
        schema=schema,
        config={
            "largest": [float(size) for size in largest],
            "body": body.to_json(),
            "law": contact_parameters.to_json(),
            "pulse_s": pulse,
            "young_kpa": 1e-3 * young,
            "free_from_s": schema.window.stop,
            **({"correction": residual[1]} if residual else {}),
            "projectile": asdict(pushes.projectile),
        },
        arrays={
            **(residual[0] if residual else {}),
            **body.arrays(),
            **body.shown(),
            "training.theta": theta.astype(np.float32),
        },
    )
