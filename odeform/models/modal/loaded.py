"""Begins motions of a body under a load: the state it starts from, and what acts on it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from odeform.checkpoint import Checkpoint
from odeform.errors import InputError
from odeform.loads.kick import STRONGER
from odeform.loads.load import Load
from odeform.loads.situation import Flight, Situation
from odeform.mechanics.flat import parts_of, start_of, unpacked
from odeform.mechanics.holding import Hold
from odeform.mechanics.obstacles import Obstacles
from odeform.mechanics.push import PARTS, Push, held, kicked, no_push
from odeform.mechanics.step import Mechanics
from odeform.mechanics.warping import Turning
from odeform.models.modal.settled import rested
from odeform.schema import Schema
from odeform.simulation.objects.catalog import SHELLS
from odeform.simulation.scenes.registry import get_scene
from odeform.types import Floats, Points, Rotations, Vector

__all__ = ["ROOM", "SUPPORT", "Beginning", "LoadedBody", "under_load"]

SUPPORT = 400  # points all over the surface that may touch the floor
ROOM = 0.08  # of a body's size: the largest RMS deformation under any load, or where few motions are known
OF_PUSHES = ("correction", "qualities", "frontier", "free_from_s", "val", "own_band", "shape_band")
MEASURED = ("val.", "gp.", "gains", "times")  # starts of the names of arrays that only pushes have


@dataclass(frozen=True, eq=False)
class Beginning:
    """B motions that are about to begin."""

    push: Push
    start: Float[np.ndarray, "batch state"]
    pulse: float
    """s, for which a sphere pushes."""
    at_rest: bool = True
    """Whether all of them begin where the body rests on the floor."""


@dataclass(frozen=True, eq=False)
class LoadedBody:
    """A body under contact parameters that may fly, and land on any side."""

    mechanics: Mechanics
    soft: int
    """Number of its modes that move by themselves."""
    anchor: Vector
    """(3,) m: where its mass centre rests, in coordinates of the body that was measured."""
    turn: Rotations
    """(3, 3), from the body that was measured to how it rests."""

    def begin(self, situations: Sequence[Situation]) -> Beginning:
        """The motions under several situations, which all have a pulse, or all have none, and as many obstacles."""
        push = _together([self._acted(situation) for situation in situations])
        push = replace(push, obstacles=Obstacles.of([situation.obstacles for situation in situations], self.anchor))
        resting = self.mechanics.start(push)
        starts = np.stack(
            [
                row if situation.flight is None else self._flying(situation.flight, push.eigenvalues.shape[1])
                for row, situation in zip(resting, situations, strict=True)
            ]
        )
        if push.hold is not None:
            push = replace(push, hold=push.hold.begun(unpacked(starts, False)))
        return Beginning(push, starts, 0.0, all(situation.flight is None for situation in situations))

    @cached_property
    def falling(self) -> Push:
        """The body that nothing but the floor touches: the same for all motions."""
        return no_push(self.mechanics.body, self.soft)

    @cached_property
    def both(self) -> Push:
        """Two like bodies."""
        return _together([self.falling, self.falling])

    def begin_pair(self, situation: Situation) -> Float[np.ndarray, "2 state"]:
        """Where two like bodies begin: the one in the air, and the other one where it stands."""
        assert situation.flight is not None
        assert situation.twin is not None
        twin, other = situation.twin, self._standing.copy()
        shift, turn, *_ = parts_of(other[None])
        other[shift] += twin.place - self.anchor * [1.0, 1.0, 0.0]
        other[turn] = (twin.turn @ other[turn].reshape(3, 3)).ravel()
        return np.stack([self._flying(situation.flight, self.both.eigenvalues.shape[1]), other])

    @cached_property
    def _standing(self) -> Float[np.ndarray, " state"]:
        """The flat state of a body that stands, as one that has landed does."""
        state = rested(self.mechanics, self.soft)[0]
        state[parts_of(state[None])[-1]] = 0.0
        return state

    def _acted(self, situation: Situation) -> Push:
        pulse = situation.pulse
        if situation.clamp is not None:
            return held(self.mechanics.body, self.soft, situation.clamp)
        if pulse is None:
            return self.falling
        return kicked(self.mechanics.body, self.soft, pulse.place.point - self.anchor, pulse)

    @cached_property
    def _free(self) -> tuple[Floats, Points]:
        """Amplitudes (K,) of the modes without stress, and the surface (N, 3) m from the mass centre there."""
        surface, free = self.mechanics.body.surface, self.mechanics.free
        amplitudes = np.zeros(self.soft) if free is None else free[: self.soft]
        motion = surface.rows[..., : len(amplitudes)] @ amplitudes
        return amplitudes, surface.points + Turning(motion[3:]).warped(motion[:3]).T

    def _flying(self, flight: Flight, directions: int) -> Floats:
        """(20 + 2 K,): the state of a body in the air."""
        (amplitudes, surface), state = self._free, start_of(directions)
        rotation = flight.rotation @ self.turn
        shift, turn, modes, _, velocity = parts_of(state[None])
        state[shift] = [0.0, 0.0, flight.height - float((surface @ rotation[2]).min())] - self.anchor
        state[turn], state[modes][: len(amplitudes)] = rotation.ravel(), amplitudes
        state[velocity][:6] = np.concatenate([flight.velocity, flight.spin])
        return state


def _together(pushes: Sequence[Push]) -> Push:
    first = pushes[0]
    if len(pushes) == 1:
        return first
    parts = {name: np.concatenate([getattr(push, name) for push in pushes]) for name in PARTS}
    patches, patch = [push.patch for push in pushes if push.patch is not None], first.patch
    if patch is not None:
        names = ("points", "rows", "forces")
        patch = replace(patch, **{name: np.concatenate([getattr(p, name) for p in patches]) for name in names})
    hold = None if first.hold is None else Hold.together([push.hold for push in pushes if push.hold is not None])
    return replace(first, **parts, patch=patch, hold=hold)


def under_load(checkpoint: Checkpoint, load: Load) -> Checkpoint:
    """The checkpoint of a mechanical model as that of another scene, in which a load acts on the same bodies.

    What was measured or regressed on pushes is not in it.
    """
    config, objects = _config(checkpoint.config), _objects(checkpoint.schema, load)
    if "objects" in config:
        config["objects"] = {
            name: {**_config(part), "schema": _schema(Schema.from_json(part["schema"]), load).to_json()}
            for name, part in config["objects"].items()
            if name in objects
        }
    arrays = {key: array for key, array in checkpoint.arrays.items() if not key.split("/")[-1].startswith(MEASURED)}
    arrays["training.theta"] = np.zeros((0, len(load.parameters)), np.float32)
    return replace(checkpoint, schema=_schema(checkpoint.schema, load), config=config, arrays=arrays)


def _config(config: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in config.items() if key not in OF_PUSHES}


def _objects(schema: Schema, load: Load) -> tuple[str, ...]:
    """The objects that can be in the scene of a load; `InputError` if there were some, and none is left."""
    left = tuple(name for name in schema.objects if not (load.pairs and name in SHELLS))
    if schema.objects and not left:
        raise InputError(f"load {load.name!r}: expected a solid, got {', '.join(schema.objects)}, which is a shell")
    return left


def _schema(schema: Schema, load: Load) -> Schema:
    scene, around = get_scene(load.scene), schema.surroundings
    surroundings = scene.surroundings
    if surroundings.contacts is not None and around is not None and around.contacts is not None:
        # bodies of the user's own are not in the scene
        own = {name: tuple(STRONGER * force for force in ends) for name, ends in around.contacts.forces.items()}
        contacts = replace(surroundings.contacts, forces={**own, **surroundings.contacts.forces})
        surroundings = replace(surroundings, contacts=contacts)
    return replace(
        schema,
        scene=load.scene,
        objects=_objects(schema, load),
        parameters=load.parameters + tuple(p for p in schema.parameters if p.role == "body"),
        window=replace(load.window, reach=load.until / load.window.stop - 1.0),
        notes=load.notes,
        surroundings=surroundings,
    )
