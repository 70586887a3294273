"""Draws pushed bodies of known mass, stiffness and friction, moved by a model or by the simulator."""

import zlib
from dataclasses import replace

import numpy as np

from odeform.errors import InputError
from odeform.identification.pushed.evidence import Evidence
from odeform.identification.pushed.forward import Forward, pushed_model
from odeform.identification.pushed.state import BODY, PushState
from odeform.identification.pushed.views import CloudView, cloud_of, points_of
from odeform.models.base import Predictor
from odeform.schema import OBJECT
from odeform.simulation.contact_draws import contact_draws
from odeform.types import Frames

__all__ = ["drawn_states", "forward_of", "seen"]


def forward_of(predictor: Predictor, name: str) -> Forward:
    """Motions of the object `name` at the frames of the window, that at rest first. `InputError` for another model."""
    model = pushed_model(predictor, {OBJECT: name})
    if model is None:
        raise InputError(f"identify: expected a mechanical model of pushed bodies, got {predictor.model}")
    return Forward(model, model.schema.window.times, {})


def drawn_states(predictor: Predictor, name: str, count: int, seed: int) -> list[PushState]:
    """`count` pushes of bodies whose mass, stiffness and friction are even draws from half to twice their own."""
    forward, forces = forward_of(predictor, name), predictor.force_range({OBJECT: name})
    key = [seed, 1, zlib.crc32(name.encode())]
    rng = np.random.default_rng(key)
    pushes = contact_draws(forward.model.rest, forces, count, key)
    return [forward.state(*push, body=rng.uniform(-1.0, 1.0, len(BODY)), strongest=forces[1]) for push in pushes]


def seen(forward: Forward, surface: Frames, view: CloudView | None, noise_mm: float, seed: int) -> Evidence:
    """A surface (T, S, 3) m as it is observed: by a camera, or else at points that are known."""
    faces = forward.model.rest.faces
    if view is not None:
        return cloud_of(forward.times, surface, faces, replace(view, noise_mm=noise_mm, seed=seed))
    return points_of(forward.times, surface, faces, noise_mm, seed)
