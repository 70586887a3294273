"""Soft shells on MuJoCo flexes: building, relaxing and stepping one body over a floor."""

# MuJoCo is a compiled module without type stubs
# pyright: reportAttributeAccessIssue=false

import math
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from odeform.simulation.material import Material, damping_time
from odeform.types import Floats, Mesh

__all__ = ["Rest", "ShellBody", "SimulationError", "relax_sphere", "run"]

CONTACT_RADIUS = 0.001  # MuJoCo's contact skin around each vertex; the floor lies this much below z = 0


ITERATIONS = 500  # of the constraint solver; the stiffest contacts take half as many


@dataclass(frozen=True)
class Rest:
    """When a body counts as at rest: RMS speed over its mass below `speed` m/s for `time` seconds."""

    speed: float
    time: float


class SimulationError(RuntimeError):
    """The simulator reported a warning or produced something non-finite; the sequence is not to be used."""


def _xml(
    mesh: Mesh, mass: float, thickness: float, material: Material, step: float, gravity: float, floor: bool
) -> str:
    # the implicit step damps like `step` seconds of its own; taken off, a rebound hardly depends on the step
    damping = max(damping_time(thickness, material) - step, 0.0)
    contact = f'friction="{material.friction} 0.005 0.0001" solref="{material.contact_time} 1"'
    plane = f'<geom type="plane" size="0 0 1" pos="0 0 {-CONTACT_RADIUS}" {contact}/>' if floor else ""
    points = " ".join(f"{x:.17g}" for x in np.asarray(mesh.points, dtype=float).ravel())
    elements = " ".join(map(str, np.asarray(mesh.faces).ravel()))
    return f"""<mujoco>
  <option timestep="{step}" integrator="discrete" gravity="0 0 {-gravity}"
    solver="CG" iterations="{ITERATIONS}"/>
  <worldbody>{plane}
    <body name="body"><flexcomp name="shell" type="direct" dim="2" mass="{mass}" radius="{CONTACT_RADIUS}"
      point="{points}" element="{elements}">
      <contact selfcollide="none" {contact}/>
      <elasticity young="{material.young}" poisson="{material.poisson}" damping="{damping}"
        thickness="{thickness}" elastic2d="both"/>
    </flexcomp></body>
  </worldbody>
</mujoco>"""


class ShellBody:
    """One shell whose vertices are the degrees of freedom, stepped in time.

    MuJoCo treats the bending force as if it turned with the world and not with the body: both its damping and the
    linearisation behind its implicit step resist rigid rotation (at EI = 3 N m a free ball loses 80 % of its spin
    in 0.1 s). Internal forces exert no torque, so `step` gives the body back the angular momentum which only the
    contact and the applied forces may change.
    """

    def __init__(
        self,
        reference: Mesh,
        mass: float,
        thickness: float,
        material: Material,
        step: float,
        gravity: float,
        floor: bool = True,
    ) -> None:
        self.model = mujoco.MjModel.from_xml_string(_xml(reference, mass, thickness, material, step, gravity, floor))
        self.data = mujoco.MjData(self.model)
        self._reference = np.array(reference.points, dtype=float)
        self.masses = self.model.body_mass[-len(self._reference) :].copy()
        self.weights = self.masses / self.masses.sum()
        self._converged = True

    @property
    def positions(self) -> Floats:
        """(N, 3) metres."""
        return self._reference + self.data.qpos.reshape(-1, 3)

    @positions.setter
    def positions(self, value: Floats) -> None:
        self.data.qpos[:] = (value - self._reference).ravel()

    @property
    def velocities(self) -> Floats:
        """(N, 3) m/s."""
        return self.data.qvel.reshape(-1, 3)

    def _centred(self) -> Floats:
        positions = self.positions
        return positions - self.weights @ positions

    def _angular_momentum(self, centred: Floats) -> Floats:
        return np.cross(centred, self.masses[:, None] * self.velocities).sum(axis=0)

    def step(self, force: Floats | None = None) -> None:
        """Advance by one time step under `force` (N, 3) in newton at the vertices."""
        self.data.qfrc_applied[:] = 0.0 if force is None else force.ravel()
        before = self._centred()
        momentum = self._angular_momentum(before)
        mujoco.mj_step(self.model, self.data)
        self._converged &= bool(self.data.solver_niter.max() < ITERATIONS)
        external = (self.data.qfrc_constraint + self.data.qfrc_applied).reshape(-1, 3)
        momentum = momentum + self.model.opt.timestep * np.cross(before, external).sum(axis=0)
        after = self._centred()
        inertia = (self.masses * (after**2).sum(axis=1)).sum() * np.eye(3) - (self.masses[:, None] * after).T @ after
        spin = np.linalg.solve(inertia, momentum - self._angular_momentum(after))
        self.velocities[:] += np.cross(spin, after)

    def check(self) -> None:
        """Raise unless the run so far is sound: finite, and free of solver warnings."""
        warnings = [w.number for w in self.data.warning]
        if any(warnings):
            raise SimulationError(f"MuJoCo warnings (contact full, constraint full, ..., divergence): {warnings}")
        if not self._converged:
            raise SimulationError(f"the constraint solver has not converged in {ITERATIONS} iterations")
        if not np.isfinite(self.data.qpos).all():
            raise SimulationError("non-finite positions")


def relax_sphere(mesh: Mesh, radius: float, thickness: float, material: Material) -> tuple[Mesh, Mesh]:
    """The stress-free ball: (`reference` for the simulator, `rest` shape of mean radius `radius`, centred at 0).

    The bending energy of MuJoCo's shells has no curved rest state: a sphere inflates as soon as it is simulated.
    Relaxed without gravity in large implicit steps with all velocity removed (a damped Newton iteration), it finds
    its equilibrium; the reference is rescaled until that equilibrium has the radius asked for.
    """
    scale, mean = 1.0, 0.0
    for _ in range(20):
        reference = Mesh(mesh.points * scale, mesh.faces)
        body = ShellBody(reference, 1.0, thickness, material, step=0.05, gravity=0.0, floor=False)
        for _ in range(40):
            mujoco.mj_step(body.model, body.data)
            body.velocities[:] = 0.0
        body.check()
        relaxed = body.positions - body.positions.mean(axis=0)
        mean = float(np.linalg.norm(relaxed, axis=1).mean())
        if abs(mean - radius) < 1e-10:
            return reference, Mesh(relaxed, mesh.faces)
        scale *= radius / mean
    raise SimulationError(f"the ball did not relax to radius {radius} m (last {mean} m) at thickness {thickness:.4f} m")


def run(
    body: ShellBody,
    until: float,
    rate: float,
    force: Callable[[float], Floats | None] = lambda _: None,
    begin: float = 0.0,
    rest: Rest | None = None,
    report: Callable[[float], None] = lambda _: None,
) -> tuple[Floats, Floats]:
    """Step the body from `begin` to `until` seconds, or till it rests.

    Returns times (T,) on the grid k / rate within that span, and vertices (T, N, 3). `report` is called every 50 steps
    with the seconds that are done.
    Frames fall between steps where the rate does not divide them: positions are then interpolated with the
    velocities of both sides (cubic Hermite), so that the step never depends on the frames asked for.
    """
    step = body.model.opt.timestep
    first = math.ceil(begin * rate - 1e-9)
    times = np.arange(first, round(until * rate) + 1) / rate
    frames = [body.positions] if times[0] <= begin + 1e-9 else []
    now, here, speed = begin, body.positions, body.velocities.copy()
    still = 0.0
    for index in range(1, round((until - begin) / step) + 1):
        body.step(force(now + 0.5 * step))
        if index % 50 == 0:
            report(now)
        after, there, speed_there = begin + index * step, body.positions, body.velocities.copy()
        while len(frames) < len(times) and times[len(frames)] <= after + 1e-9:
            s = (times[len(frames)] - now) / step
            frames.append(
                (1 + 2 * s) * (1 - s) ** 2 * here
                + s * (1 - s) ** 2 * step * speed
                + s**2 * (3 - 2 * s) * there
                + s**2 * (s - 1) * step * speed_there
            )
        now, here, speed = after, there, speed_there
        if rest is not None:
            still = still + step if body.weights @ (speed**2).sum(axis=1) < rest.speed**2 else 0.0
            if still >= rest.time:
                break
    body.check()
    return times[: len(frames)], np.stack(frames)
