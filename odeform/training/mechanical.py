"""The training of the mechanical model: a law of contact and material for all bodies of a data set, then for each."""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.mechanics.law import MechanicalLaw
from odeform.models.mechanical.elastic_body import elastic_body
from odeform.models.mechanical.model import MechanicalODeform
from odeform.models.per_object import joined
from odeform.motion.reduced_space import POSE
from odeform.parallel import as_completed
from odeform.progress import Progress
from odeform.simulation.objects.catalog import OBJECTS, get_object
from odeform.training import mechanical_law
from odeform.training.mechanical_correction import fit_correction
from odeform.training.mechanical_law import STEP, described, fit_law, relative_errors
from odeform.training.pushes import Pushes, read_pushes
from odeform.training.saved_laws import SHARED, SavedLaws
from odeform.types import Arrays

__all__ = ["fit_mechanical"]

SEQUENCES = 8  # of each body, to which the law that all share is fitted; it has ten numbers
OWN_SEQUENCES = 32  # to which that of one body is
FIXED = {"pulse_s", "projectile_radius_m", "projectile_mass_kg"}
MODES, LEFT_OUT = (120, 200), 0.2  # the second number of modes where the first leaves out more of the deformation
Checkpointed = tuple[Arrays, dict[str, Any]]
QUALITIES = {
    "draft": {"method": "limex", "tolerance": 1e-3, "dtype": "float64"},
    "balanced": {"method": "limex", "tolerance": 2.5e-4, "dtype": "float64"},
    "reference": {"method": "limex", "step": 2.5e-4, "dtype": "float64"},
}


def fit_mechanical(
    dataset: Dataset, laws: SavedLaws, seed: int, report: Callable[[str], None], correct: bool = True
) -> Checkpoint:
    """Train on the objects of a data set of the scene `contact-force`; laws that are finished are kept in `laws`, and
    those that it has are not fitted again.

    Without `correct`, motions are those of the mechanics alone. `InputError` for other data.
    """
    missing = [name for name in dataset.objects if name not in OBJECTS]
    if missing or not dataset.objects or not set(dataset.fixed) >= FIXED:
        raise InputError(
            f"{dataset.root}: expected data of scene contact-force, of objects {', '.join(OBJECTS)}; "
            f"got scene {dataset.schema.scene}"
        )
    begin, pulse = time.process_time(), dataset.fixed["pulse_s"]
    each: dict[str, Pushes] = {}
    for name in dataset.objects:
        each[name] = _training_pushes(dataset, name)
        pushes = each[name]
        report(
            f"{name}: {len(pushes.contacts)} pushes; {len(pushes.body.squares)} modes leave out "
            f"{100.0 * pushes.share_left_out:.0f} % of the deformation"
        )
    shared = laws.get(SHARED)
    if shared is None:
        some = [pushes.some(SEQUENCES, seed) for pushes in each.values()]
        shared = fit_law(some, pulse, MechanicalLaw(), report=report)
        laws.add(SHARED, shared)
    evaluations = mechanical_law.EVALUATIONS
    bodies = [
        _Body(
            pushes,
            read_pushes(dataset.of(name), "val", pushes.body),
            shared,
            laws.get(name),
            pulse,
            seed,
            evaluations,
            correct,
        )
        for name, pushes in each.items()
    ]
    found: dict[str, tuple[MechanicalLaw, Checkpointed | None]] = {}
    spent, names = time.process_time() - begin, list(each)
    progress = Progress("bodies", len(bodies))
    for index, (law, correction, seconds) in as_completed(_fitted, bodies):
        name, spent = names[index], spent + seconds
        laws.add(name, law)
        found[name] = law, correction
        report(f"{name}: {described(law)}")
        progress.advance(note=name)
    progress.close()
    parts = {
        name: _checkpoint(dataset.of(name), pushes, found[name][0], pulse, found[name][1])
        for name, pushes in each.items()
    }
    whole = joined(dataset.schema, parts)
    return replace(whole, config={**whole.config, "val": {"seconds": spent}})


@dataclass(frozen=True, eq=False)
class _Body:
    """What the fit of one body needs."""

    train: Pushes
    val: Pushes
    shared: MechanicalLaw
    own: MechanicalLaw | None
    """Its law, if an interrupted training has finished it."""
    pulse: float
    seed: int
    evaluations: int
    correct: bool


def _fitted(body: _Body) -> tuple[MechanicalLaw, Checkpointed | None, float]:
    """Its law, its correction, and the seconds of processor time that they took."""
    begin = time.process_time()
    law = _law(body) if body.own is None else body.own
    correction = fit_correction(body.train, body.val, law, body.pulse) if body.correct else None
    return law, correction, time.process_time() - begin


def _law(body: _Body) -> MechanicalLaw:
    """That of all bodies unless its own is better on validation motions.

    Friction and damping of the simulator depend on how mass and vertices are spread in a body.
    """
    some = [body.train.some(OWN_SEQUENCES, body.seed)]
    own = fit_law(some, body.pulse, body.shared, report=lambda _: None, evaluations=2 * body.evaluations)

    def error(law: MechanicalLaw) -> float:
        return float(np.square(relative_errors(body.val, body.val.predicted(law, body.pulse, STEP))).sum())

    return min(own, body.shared, key=error)


def _training_pushes(dataset: Dataset, name: str) -> Pushes:
    """With as many modes as the body's motions ask for."""
    few, many = MODES
    pushes = read_pushes(dataset.of(name), "train", elastic_body(get_object(name), few))
    if pushes.share_left_out <= LEFT_OUT:
        return pushes
    return read_pushes(dataset.of(name), "train", elastic_body(get_object(name), many))


def _checkpoint(
    dataset: Dataset, pushes: Pushes, law: MechanicalLaw, pulse: float, correction: Checkpointed | None = None
) -> Checkpoint:
    """That of one body."""
    body = pushes.body
    largest = [np.linalg.norm(pushes.reduced[..., part], axis=-1).max() for part in (slice(0, 3), slice(POSE, None))]
    schema = dataset.schema
    theta = [schema.vector(entry.parameters) for entry in dataset.select("train")]
    return Checkpoint(
        model=MechanicalODeform.model,
        schema=schema,
        config={
            "largest": [float(size) for size in largest],
            "body": body.to_json(),
            "law": asdict(law),
            "pulse_s": pulse,
            **({"correction": correction[1]} if correction else {}),
            "projectile": asdict(pushes.projectile),
            "qualities": QUALITIES,
        },
        arrays={
            **(correction[0] if correction else {}),
            **body.arrays(),
            **body.shown(),
            "training.theta": np.array(theta, dtype=np.float32),
        },
    )
