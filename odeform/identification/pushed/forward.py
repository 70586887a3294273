"""Predicts the surface of a pushed body for guesses of what is unknown, and how it changes with them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from odeform.errors import InputError
from odeform.geometry.contact import checked_contact, nearest_on
from odeform.geometry.shape import surface_weights
from odeform.identification.pushed.state import BODY, FRICTION, PUSH_STEPS, PushState, body_steps
from odeform.loads.load import Load
from odeform.loads.measured import error_after_contact
from odeform.models.base import Predictor
from odeform.models.modal.model import ModalModel
from odeform.motion.base import Motion
from odeform.motion.reduced_motion import as_reduced, moved_points, placements
from odeform.schema import Parameter, Parameters
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Frames, Times

__all__ = ["Forward", "pushed_model", "with_friction"]

SETTINGS = SolverSettings("limex", step=1e-3, dtype="float64")
"""Even steps: motions are smooth functions of the parameters, which differences need."""
LANDING = SolverSettings("limex", tolerance=3e-5, dtype="float64")
"""Bodies hit the floor faster than a sphere pushes them: steps that suit pushes leave differences of the chip rough."""
CONTACT_STEP, FORCE_STEP = 0.02, 0.01  # of differences, in units of `PushState.stepped`
FRICTION_RANGE = 2.0  # factor by which friction may differ from that of the model


def pushed_model(predictor: Predictor, parameters: Parameters) -> ModalModel | None:
    """The model of the one body that parameters select, if it can be identified by pushes; otherwise None."""
    named = {name: value for name, value in parameters.items() if isinstance(value, str)}
    named = named or dict(getattr(predictor, "parameters_like", dict)())
    part = predictor.model_of(named) if predictor.schema.objects or named else predictor
    if not isinstance(part, ModalModel) or part.load is not None or set(part.own_values) != {"mass", "young"}:
        return None
    return part


def with_friction(model: ModalModel, ratio: float) -> ModalModel:
    """The same body, with so many times its coefficients of friction against the floor and the sphere."""
    if abs(ratio - 1.0) < 1e-9:
        return model
    known = model.contact_parameters
    rougher = replace(known, floor_friction=ratio * known.floor_friction, push_friction=ratio * known.push_friction)
    return model.with_contact_parameters(rougher)


class Forward:
    """Motions of one body, at times (T,) s; the surface has S vertices."""

    def __init__(self, model: ModalModel, times: Times, named: Parameters | None = None) -> None:
        """`named` are parameters that the model wants besides, such as the name of the object."""
        self.model, self.times, self.named = model, times, dict(named or {})
        self.friction = model.contact_parameters.floor_friction
        ranges = {p.name: p for p in model.schema.parameters}
        own = model.own_values
        self.ranges = (
            *(replace(ranges[name], low=own[name] / 2.0, high=own[name] * 2.0, default=own[name]) for name in own),
            Parameter(
                FRICTION, "", self.friction / FRICTION_RANGE, self.friction * FRICTION_RANGE, self.friction, "log"
            ),
        )
        self.until = float(times.max())
        self._falling = dict[str, Predictor]()

    def without_residual(self) -> "Forward":
        """Motions by mechanics alone: what is regressed does not change with the body, and weighs down what does."""
        return Forward(self.model.without_residual(), self.times, self.named)

    def state(self, contact: Floats, force: Floats, body: Floats | None = None, strongest: float = 1.0) -> PushState:
        """The state of a push at `contact` (3,) m by `force` (3,) N on the body as it was measured, or on another."""
        unit = np.zeros(len(BODY)) if body is None else np.asarray(body, dtype=float)
        place, pull = (np.asarray(vector, dtype=float) for vector in (contact, force))
        return PushState(self.model.rest, self.ranges, strongest, unit, place, pull)

    def _model_of(self, state: PushState) -> ModalModel:
        return with_friction(self.model.changed(state.parameters()), state.value(FRICTION) / self.friction)

    def motions(self, states: Sequence[PushState]) -> Float[np.ndarray, "batch times points 3"]:
        """(B, T, S, 3) m: the surface for states of one and the same body."""
        sets = [{**self.named, **state.parameters()} for state in states]
        model = self._model_of(states[0])
        if len(sets) == 1:
            return self._surface(model.solve(None, sets[0], SETTINGS, self.until))[None]
        batch = {name: [one[name] for one in sets] for name in sets[0] if name not in self.named}
        for name in ("mass", "young"):
            batch[name] = batch[name][0]
        solved = model.solve_batch({**self.named, **batch}, quality=SETTINGS, until=self.until)
        return solved.vertices(self.times).astype(float)

    def fallen(
        self, load: Load, experiments: Sequence[Parameters], body: Floats, times: Times
    ) -> Float[np.ndarray, "experiments times points 3"]:
        """(E, T, S, 3) m at times (T,) s: the surface of a body (3,), `BODY` in [-1, 1], in drops or throws."""
        if load.name not in self._falling:  # what all its bodies share is computed once
            self._falling[load.name] = self.model.under(load.name)
        falling = self._falling[load.name]
        assert isinstance(falling, ModalModel)
        unit = self.state(np.zeros(3), np.zeros(3), body)
        own = {name: unit.value(name) for name in BODY if name != FRICTION}
        model = with_friction(falling.changed(own), unit.value(FRICTION) / self.friction)
        drawn = {p.name: np.array([row[p.name] for row in experiments]) for p in load.parameters}
        sets = {**self.named, **drawn, **own}
        return model.solve_batch(sets, quality=LANDING, until=float(times[-1])).vertices(times)

    def fall_errors(self, moved: Frames) -> Times:
        """(T,) mm by which a motion (T, S, 3) m from the first contact on is expected to be wrong, as was measured of
        the body as it is by itself.

        The same at all times: nothing else was measured, and in proportion to the displacement at each time, which is
        small at first, it would promise far too much.
        """
        away = ((moved - moved[:1]) ** 2).sum(axis=2) @ surface_weights(self.model.rest)
        share = error_after_contact(next(iter(self.model.schema.objects), ""))
        return np.full(len(moved), 1e3 * share * np.sqrt(away.mean()))

    def _surface(self, motion: Motion) -> Floats:
        """(T, S, 3) m, without the check that it is plausible: guesses need none."""
        reduced = as_reduced(motion)
        y = reduced.trajectory.reduced(self.times)
        return moved_points(reduced.evaluated, y, *placements(reduced.space, y, 0.0)).astype(float)

    def jet(self, state: PushState, free: Sequence[int]) -> tuple[Floats, Floats]:
        """The surface (T, S, 3) m and its slopes (F, T, S, 3) along the steps `free` of `PushState.stepped`.

        Forward differences, backward where a sphere cannot push; a step that is impossible both ways has slope zero.
        """
        pushed, made = [index for index in free if index >= len(BODY)], [index for index in free if index < len(BODY)]
        around = [self._step(state, _along(index)) for index in pushed]
        moved = self.motions([state, *(one for one, _ in around)])
        base = moved[0]
        slopes = [
            (row - base) / (signed * _along(index)[index])
            for index, row, (_, signed) in zip(pushed, moved[1:], around, strict=True)
        ]
        steps, changes = body_steps(state.body, made), []
        for step in steps:
            ahead, signed = self._step(state, np.append(step, np.zeros(PUSH_STEPS)))
            changes.append((self.motions([ahead])[0] - base) / signed)
        inverse = np.linalg.inv(steps[:, made])
        body = [sum(share * each for share, each in zip(row, changes, strict=True)) for row in inverse]
        every = dict(zip([*made, *pushed], [*body, *slopes], strict=True))
        return base, np.stack([every[index] for index in free])

    def check(self, state: PushState) -> None:
        """`InputError` where the sphere does not fit once the body has settled: a softer one lies lower."""
        settled = self._model_of(state).settled(state.parameters())
        place = nearest_on(self.model.rest, state.contact).moved(settled.points, settled.faces)
        checked_contact(settled, place, state.force)

    def _step(self, state: PushState, step: Floats) -> tuple[PushState, float]:
        """The state after a step (8,) ahead, or back where that is impossible, and 1 or -1; after none, if both are."""
        for signed in (1.0, -1.0):
            try:
                stepped = state.stepped(signed * step)
                self.check(stepped)
                return stepped, signed
            except InputError:
                continue
        return state, 1.0


def _along(index: int) -> Floats:
    """(8,) the step of a difference of the contact or the force."""
    step = np.zeros(len(BODY) + PUSH_STEPS)
    step[index] = CONTACT_STEP if index < len(BODY) + 2 else FORCE_STEP
    return step
