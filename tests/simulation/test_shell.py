"""Physics that a free ball has to obey, whatever its wall."""

import functools
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from odeform.geometry.rigid import best_rigid
from odeform.simulation import flex
from odeform.simulation.errors import SimulationError
from odeform.simulation.material import wall_thickness
from odeform.simulation.objects.ball import MATERIAL, RADIUS, STEP, relaxed, stress_free
from odeform.simulation.physics import GRAVITY
from odeform.simulation.scenes.kick import simulate
from odeform.simulation.shell import ShellBody
from odeform.simulation.stepping import Rest, run
from odeform.types import Mesh

MASS = 0.5

soft_and_stiff = pytest.mark.parametrize("bending", [0.3, 3.0])


@functools.cache
def relaxed_ball(bending: float) -> tuple[Mesh, Mesh]:
    sphere = trimesh.creation.icosphere(2, RADIUS)
    mesh = Mesh(np.asarray(sphere.vertices), np.asarray(sphere.faces))
    return relaxed(mesh, RADIUS, wall_thickness(bending, MATERIAL), MATERIAL)


def ball(bending: float, gravity: float = 0.0, step: float = STEP) -> ShellBody:
    """At rest without a floor."""
    reference, rest = relaxed_ball(bending)
    body = ShellBody(reference, MASS, wall_thickness(bending, MATERIAL), MATERIAL, step, gravity, floor=False)
    body.positions = rest.points
    return body


def momentum(body: ShellBody) -> np.ndarray:
    lever = body.positions - body.weights @ body.positions
    return np.cross(lever, body.masses[:, None] * body.velocities).sum(axis=0)


@soft_and_stiff
def test_stress_free_ball_stays_at_rest(bending: float) -> None:
    _, rest = relaxed_ball(bending)
    assert np.linalg.norm(rest.points, axis=1).mean() == pytest.approx(RADIUS, abs=1e-9)
    body = ball(bending)
    _, frames = run(body, 0.1, 100.0, lambda _: None)
    rotation, shift = best_rigid(frames[0], frames, body.weights)
    centre = body.weights @ frames[0]
    rigid = (frames[0] - centre) @ rotation.swapaxes(1, 2) + (centre + shift)[:, None]
    assert np.linalg.norm(frames - rigid, axis=-1).max() < 5e-5


@soft_and_stiff
def test_free_ball_keeps_its_spin(bending: float) -> None:
    body = ball(bending)
    body.velocities[:] = np.cross([10.0, -20.0, 5.0], body.positions)
    before = momentum(body)
    _, frames = run(body, 0.1, 100.0, lambda _: None)
    assert np.linalg.norm(momentum(body) - before) < 1e-3 * np.linalg.norm(before)
    # and really turns by the angle of that spin, but for the little that it widens under it
    rotation, _ = best_rigid(frames[0], frames, body.weights)
    angle = np.arccos(0.5 * (np.trace(rotation[1]) - 1.0))
    assert angle == pytest.approx(0.01 * np.sqrt(525.0), rel=0.05)


def test_mujoco_alone_takes_most_of_a_stiff_balls_spin() -> None:
    """Why `step` gives the spin back. Once this fails, MuJoCo has mended it and the correction can go."""
    body = ball(3.0)
    body.velocities[:] = np.cross([0.0, 10.0, 0.0], body.positions)
    before = momentum(body)
    for _ in range(round(0.1 / STEP)):
        mujoco.mj_step(body.model, body.data)
    assert np.linalg.norm(momentum(body)) < 0.5 * np.linalg.norm(before)


@soft_and_stiff
def test_free_fall(bending: float) -> None:
    body = ball(bending, gravity=GRAVITY)
    body.velocities[:] += [1.0, 0.5, 2.0]
    times, frames = run(body, 0.1, 100.0, lambda _: None)
    centre = np.einsum("n,tni->ti", body.weights, frames)
    true = centre[0] + times[:, None] * [1.0, 0.5, 2.0] - 0.5 * GRAVITY * times[:, None] ** 2 * [0.0, 0.0, 1.0]
    # a first-order step in time misses half a step's velocity gain
    assert np.abs(centre - true).max() < 1.01 * 0.5 * GRAVITY * 0.1 * STEP


def test_a_force_pushes_the_whole_ball() -> None:
    body = ball(0.6)
    force = np.zeros_like(body.positions)
    force[3] = [6.0, 0.0, 0.0]
    run(body, 0.02, 100.0, lambda time: force if time < 0.01 else None)
    assert body.weights @ body.velocities == pytest.approx([0.06 / MASS, 0.0, 0.0], abs=1e-6)


def test_frames_asked_for_do_not_change_the_motion() -> None:
    """Rates that divide the steps and rates that do not."""
    times, frames = {}, {}
    for rate in (100.0, 120.0, 300.0):
        body = ball(0.6)
        body.velocities[:] = np.cross([0.0, 40.0, 0.0], body.positions) * [1.0, 1.0, 0.5]
        times[rate], frames[rate] = run(body, 0.05, rate, lambda _: None)
    assert [len(frames[rate]) for rate in (100.0, 120.0, 300.0)] == [6, 7, 16]
    assert np.allclose(frames[100.0], frames[300.0][::3], rtol=0.0, atol=1e-12)
    # between steps: what neighbours of a finer rate say, to the order of their distance
    between = [np.interp(times[120.0], times[300.0], x) for x in frames[300.0].reshape(16, -1).T[:30]]
    assert np.abs(np.array(between).T - frames[120.0].reshape(7, -1)[:, :30]).max() < 2e-4


def test_a_diverging_run_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo leaves a log where it runs
    parameters = {"mass": 0.3, "bending": 3.0, "force": 1e12, "azimuth": 0.0, "elevation": 0.6}
    with pytest.raises(SimulationError):
        simulate(parameters, rate=120.0, step=5e-3, resolution=4)


def test_an_unconverged_contact_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    body, _, _ = stress_free({"mass": MASS, "bending": 0.6}, 1e-3, segments=4)
    monkeypatch.setattr(flex, "ITERATIONS", 2)
    with pytest.raises(SimulationError, match="converged"):
        run(body, 0.1, 100.0)


def test_begins_later() -> None:
    """The clock starts at `begin`: for the frames, and for the force."""
    body, asked = ball(0.6), []
    start = body.positions
    body.velocities[:] = [1.0, 0.0, 0.0]

    def force(time: float) -> None:
        asked.append(time)

    times, frames = run(body, 0.05, 100.0, force, begin=0.012)
    assert np.allclose(times, [0.02, 0.03, 0.04, 0.05], atol=1e-12)
    assert np.allclose(asked, 0.012 + STEP * (np.arange(76) + 0.5), atol=1e-9)
    centres = np.einsum("n,tni->ti", body.weights, frames - start)
    assert np.allclose(centres, (times - 0.012)[:, None] * [1.0, 0.0, 0.0], atol=1e-9)


def test_begins_on_a_frame() -> None:
    body = ball(0.6)
    start = body.positions
    times, frames = run(body, 0.05, 100.0, begin=0.02)
    assert np.allclose(times, [0.02, 0.03, 0.04, 0.05], atol=1e-12)
    assert np.array_equal(frames[0], start)


def drifting(speed: float, push: Callable[[float], float] = lambda _: 0.0) -> int:
    """Frames at 100 Hz of a run of 0.3 s, which ends after 0.05 s below 0.01 m/s. `push` is in m/s^2."""
    body = ball(0.6)
    body.velocities[:] = [speed, 0.0, 0.0]
    along = body.masses[:, None] * [1.0, 0.0, 0.0]
    return len(run(body, 0.3, 100.0, lambda time: push(time) * along, rest=Rest(0.01, 0.05))[0])


def test_ends_at_rest() -> None:
    assert drifting(0.009) == 6
    assert drifting(0.011) == 31
    # slow enough after 0.145 s, and at rest 0.05 s later
    assert drifting(0.01145, lambda _: -0.01) == 20


def test_turns_are_no_rest() -> None:
    """To and fro at 0.03 m/s, four times slow for 0.016 s: together longer than a rest, and none."""
    beat = 2.0 * np.pi / 0.15
    assert drifting(0.03, lambda time: -0.03 * beat * np.sin(beat * time)) == 31
