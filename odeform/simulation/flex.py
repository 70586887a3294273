"""One MuJoCo flex whose vertices are the degrees of freedom. Shells and solids differ in their model's XML alone."""

# MuJoCo is a compiled module without type stubs
# pyright: reportAttributeAccessIssue=false

import mujoco
import numpy as np

from odeform.simulation.errors import SimulationError
from odeform.types import Floats, Points

__all__ = ["CONTACT_RADIUS", "ITERATIONS", "FlexBody"]

CONTACT_RADIUS = 0.001  # MuJoCo's contact skin around each vertex; the floor lies this much below z = 0
ITERATIONS = 500  # of the constraint solver; the stiffest contacts take half as many


class FlexBody:
    """A flexible body of N vertices, stepped in time. It is a `odeform.simulation.stepping.Body`."""

    def __init__(self, xml: str, reference: Points) -> None:
        """`xml` is the MuJoCo model; `reference` (N, 3) m are the positions at which all its coordinates are 0."""
        self.model = mujoco.MjModel.from_xml_string(xml)
        self.data = mujoco.MjData(self.model)
        self._reference = np.array(reference, dtype=float)
        self.masses = self.model.body_mass[-len(self._reference) :].copy()
        self.weights = self.masses / self.masses.sum()
        self._converged = True

    @property
    def timestep(self) -> float:
        """Seconds."""
        return self.model.opt.timestep

    @property
    def positions(self) -> Floats:
        """(N, 3) metres."""
        return self._reference + self.data.qpos.reshape(-1, 3)

    @positions.setter
    def positions(self, value: Floats) -> None:
        self.data.qpos[:] = (value - self._reference).ravel()

    @property
    def velocities(self) -> Floats:
        """(N, 3) m/s, a view that may be written to."""
        return self.data.qvel.reshape(-1, 3)

    def step(self, force: Floats | None = None) -> None:
        """Advance by one time step under `force` (N, 3) in newton at the vertices."""
        self.data.qfrc_applied[:] = 0.0 if force is None else force.ravel()
        mujoco.mj_step(self.model, self.data)
        self._converged &= bool(self.data.solver_niter.max() < ITERATIONS)

    def check(self) -> None:
        """Raise `SimulationError` unless the run so far is finite, converged and free of solver warnings."""
        warnings = [w.number for w in self.data.warning]
        if any(warnings):
            raise SimulationError(f"MuJoCo warnings (contact full, constraint full, ..., divergence): {warnings}")
        if not self._converged:
            raise SimulationError(f"the constraint solver has not converged in {ITERATIONS} iterations")
        if not np.isfinite(self.data.qpos).all():
            raise SimulationError("non-finite positions")
