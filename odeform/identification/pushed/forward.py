"""Predicts the surface of a pushed body for guesses of what is unknown, and how it changes with them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from odeform.errors import InputError
from odeform.geometry.contact import checked_contact, nearest_on
from odeform.identification.pushed.state import BODY, FRICTION, PUSH, PushState
from odeform.models.base import Predictor
from odeform.models.modal.model import ModalModel
from odeform.motion.base import Motion
from odeform.motion.reduced_motion import as_reduced, moved_points, placements
from odeform.schema import Parameter, Parameters
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Times

__all__ = ["BODY_STEP", "Forward", "pushed_model", "with_friction"]

SETTINGS = SolverSettings("limex", step=1e-3, dtype="float64")
"""Even steps: motions are smooth functions of the parameters, which differences need."""
BODY_STEP, CONTACT_STEP, FORCE_STEP = 0.05, 0.02, 0.01  # of differences, in units of `PushState.stepped`
FRICTION_RANGE = 2.0  # factor by which friction may differ from that of the model


def pushed_model(predictor: Predictor, parameters: Parameters) -> ModalModel | None:
    """The model of the one body that parameters select, if it can be identified by pushes; otherwise None."""
    part = predictor.model_of(parameters) if predictor.schema.objects or parameters else predictor
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

    def _surface(self, motion: Motion) -> Floats:
        """(T, S, 3) m, without the check that it is plausible: guesses need none."""
        reduced = as_reduced(motion)
        y = reduced.trajectory.reduced(self.times)
        return moved_points(reduced.evaluated, y, *placements(reduced.space, y, 0.0)).astype(float)

    def jet(self, state: PushState, free: Sequence[int]) -> tuple[Floats, Floats]:
        """The surface (T, S, 3) m and its slopes (F, T, S, 3) along the steps `free` of `PushState.stepped`.

        Forward differences, backward where a sphere cannot push; a step that is impossible both ways has slope zero.
        """
        pushed = [index for index in free if index >= len(BODY)]
        steps = {index: self._step(state, index) for index in free}
        around = [steps[index] for index in pushed]
        moved = self.motions([state, *(one for one, _ in around)])
        base = moved[0]
        slopes = {index: (row - base) / steps[index][1] for index, row in zip(pushed, moved[1:], strict=True)}
        for index in free:
            if index < len(BODY):
                ahead, length = steps[index]
                slopes[index] = (self.motions([ahead])[0] - base) / length
        return base, np.stack([slopes[index] for index in free])

    def check(self, state: PushState) -> None:
        """`InputError` where the sphere does not fit once the body has settled: a softer one lies lower."""
        settled = self._model_of(state).settled(state.parameters())
        place = nearest_on(self.model.rest, state.contact).moved(settled.points, settled.faces)
        checked_contact(settled, place, state.force)

    def _step(self, state: PushState, index: int) -> tuple[PushState, float]:
        length = BODY_STEP if index < len(BODY) else CONTACT_STEP if index < len(BODY) + 2 else FORCE_STEP
        inward = index < len(BODY) and state.body[index] + length > 1.0
        for signed in (-length,) if inward else (length, -length):
            step = np.zeros(len(BODY) + PUSH)
            step[index] = signed
            try:
                stepped = state.stepped(step)
                self.check(stepped)
                return stepped, signed
            except InputError:
                continue
        return state, length
