"""Whether a body that begins in the air gains energy: floor, obstacles and springs that hold it can only take some."""

import numpy as np

from odeform.loads.situation import Flight
from odeform.models.modal.model import ModalModel
from odeform.motion.base import Motion
from odeform.motion.plausibility import energy_of
from odeform.surroundings import GRAVITY
from odeform.types import Floats, Times

__all__ = ["energy_gained"]


def energy_gained(model: ModalModel, motion: Motion, flight: Flight, times: Times) -> float:
    """By how much the energy of the rigid motion exceeds what a flight begins with, as a fraction of it, at most; 0
    where it never does.

    At evenly spaced `times` (T,) s, from whose differences velocities are taken. What is in vibrations counts as lost,
    so that no motion that loses energy is found to gain some.
    """
    rest, solid = model.changed(motion.parameters).mechanics.rest, model.body.solid
    middle = model.body.anchor + (0.0 if rest is None else rest.shift)
    pose = motion.pose(times)
    centres = pose[:, :3, :3] @ middle + pose[:, :3, 3]
    lowest = float(motion.vertices(times)[..., 2].min())
    inertia = solid.inertia / solid.mass
    moving = energy_of(times, centres, lowest, GRAVITY) + _turning(pose[:, :3, :3], times, inertia)
    spin = flight.rotation.T @ flight.spin
    begun = 0.5 * float(flight.velocity @ flight.velocity + spin @ inertia @ spin)
    begun += GRAVITY * (float(centres[0, 2]) - lowest)
    return max(float(moving.max()) / begun - 1.0, 0.0)


def _turning(rotations: Floats, times: Times, inertia: Floats) -> Floats:
    """(T - 2,) energy of the spin per mass, m^2/s^2, of rotations (T, 3, 3) with inertia per mass (3, 3) m^2."""
    step = rotations[2:] @ rotations[:-2].swapaxes(1, 2) - rotations[:-2] @ rotations[2:].swapaxes(1, 2)
    sines = 0.5 * np.stack([step[:, 2, 1], step[:, 0, 2], step[:, 1, 0]], axis=1)
    spin = sines / (times[2:] - times[:-2])[:, None]
    local = np.einsum("tji,tj->ti", rotations[1:-1], spin)
    return 0.5 * np.einsum("ti,ij,tj->t", local, inertia, local)
