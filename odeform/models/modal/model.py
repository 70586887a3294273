"""ODeform for bodies of known shape and material: the ODE is reduced mechanics, with few learned numbers."""

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from jaxtyping import Float

from odeform.checkpoint import Checkpoint
from odeform.geometry.contact import checked_contact
from odeform.geometry.shape import surface_weights
from odeform.loads.load import Load
from odeform.loads.registry import load_of_scene
from odeform.loads.situation import Situation
from odeform.mechanics.body import Solid
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.mechanics.inside import Inside, inside_of
from odeform.mechanics.pair import Pair
from odeform.mechanics.push import make_push
from odeform.mechanics.pushed import PushedBody
from odeform.mechanics.pushed_batch import pushed_bodies
from odeform.mechanics.step import Mechanics, Projectile
from odeform.models.base import Predictor
from odeform.models.contact.inputs import ContactInputs
from odeform.models.modal.contact_residual import contact_residual
from odeform.models.modal.coordinates import Coordinates, coordinates_of, space_of
from odeform.models.modal.elastic_body import ElasticBody
from odeform.models.modal.energy_bound import LOOKED_AHEAD, BoundedBatch, BoundedTrajectory
from odeform.models.modal.loaded import ROOM, Beginning, LoadedBody, under_load
from odeform.models.modal.loaded import SUPPORT as SIDES
from odeform.models.modal.paired import Shapes, pair_motion, pair_problem
from odeform.models.modal.readout import Readout
from odeform.models.modal.release import before
from odeform.models.modal.settled import SettledBody, settled_body
from odeform.models.modal.user_part import forces_in, item_in
from odeform.models.model import Model
from odeform.models.solved import Problem
from odeform.models.solved_batch import BatchProblem, SolvedBatch
from odeform.motion.base import Motion
from odeform.motion.batch_trajectory import AdjustedBatch, BatchTrajectory, PiecewiseBatch
from odeform.motion.body import CheckedBody
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.floor_projection import FloorProjection
from odeform.motion.ground import Ground
from odeform.motion.motion_batch import MotionBatch
from odeform.motion.recent import Recent, geometry_key
from odeform.motion.reduced_space import ReducedSpace
from odeform.motion.trajectory import Adjusted, Moving, Piecewise, Trajectory
from odeform.motion.validity import Validity
from odeform.schema import Parameters
from odeform.simulation.contacts import MASS, YOUNG
from odeform.simulation.objects.soft_object import SoftObject
from odeform.solver.integrate import SolverSettings
from odeform.types import Basis, Floats, Geometry, Mesh, MotionSequence, PointCloud, Times, Vectors

if TYPE_CHECKING:
    from odeform.models.training.run import Run

__all__ = ["EXACT", "QUALITIES", "ModalModel"]

HEIGHTS = 1  # times of each trained frame at which it is looked up how low a body is
SAME = 1e-3  # relative difference of mass or stiffness from which on they count as changed
SETTLED = 4  # bodies of another mass and stiffness that are kept
SKIN = 1e-3  # m below the floor, where what lies on it is flat: bodies at rest are up to that deep in it
FLATTENED = 0.5  # of its smallest extent, by which a body that lands may be deeper than the floor on which it is flat
SPARE = 1e-3  # m above the depth from which on a motion counts as lost, and below that of a body at rest
LAWFUL = 0.5  # of the largest deformation, up to which no motion was seen to gain energy
CALMS = 0.2  # s after the window, in which what presses a body into the floor dies away

QUALITIES = {
    "draft": SolverSettings("limex", tolerance=5e-4, dtype="float64"),
    "balanced": SolverSettings("limex", tolerance=1.5e-4, dtype="float64"),
    "reference": SolverSettings("limex", step=2.5e-4, dtype="float64"),
}
"""Settings of bodies whose solver errors were not measured."""
LANDING = {**QUALITIES, "balanced": SolverSettings("limex", tolerance=2.5e-4, dtype="float64")}
"""Those of bodies that land: the solver is off by 0.6 % of the displacement in the mean, where the model is by 35 %."""
EXACT = SolverSettings("limex", step=1.25e-4, dtype="float64")
"""The reference for solver errors."""


class ModalModel(Model):
    """The motion of one elastic body on the floor that a projectile pushes."""

    model = "modal"
    made_of = (
        "mechanics: elastic modes of the body's own mesh, with ten fitted contact parameters for each object and no "
        "network; a kernel regression in the contact's frame adds what they leave unexplained"
    )
    together = 32
    accurate = QUALITIES["reference"]
    rescales_input = False
    continues_itself = True
    fallback = SolverSettings("limex", step=2.5e-3, dtype="float64")
    finer = MappingProxyType({EXACT: 0.0})
    knows_objects = True
    resumable = True
    takes_loads = True
    ablations: ClassVar[Mapping[str, str]] = {"residual": "what is left unexplained is not regressed"}

    @classmethod
    def train(cls, run: "Run") -> Checkpoint:
        from odeform.models.modal.training.fit import train_modal

        return train_modal(run)

    @classmethod
    def under_load(cls, checkpoint: Checkpoint, load: Load) -> Checkpoint:
        return under_load(checkpoint, load)

    def _read(self, checkpoint: Checkpoint) -> None:
        config = checkpoint.config
        self.body = ElasticBody.from_parts(checkpoint.arrays, config["body"])
        self.load = load_of_scene(checkpoint.schema.scene)
        self._flies = self.load is not None and self.load.flies
        self._pairs, self._shapes = self.load is not None and self.load.pairs, Shapes()
        # a kicked body stands on its floor as one that is pushed, or lands on it as one that falls: training chose
        falls = self._flies or (self.load is not None and config.get("kicked_as") == "impact")
        law = config.get("impact", config["law"]) if falls else config["law"]
        self.contact_parameters, self.pulse = ContactParameters.from_json(law), float(config["pulse_s"])
        if self.load is not None and self.load.held:
            self.contact_parameters = replace(self.contact_parameters, stiffness=1.0, damping=1.0)
        self.projectile = Projectile(**config["projectile"])
        shift, deformation = config["largest"]
        self._largest, self._flat_on = (float(shift), float(deformation)), None
        if self.load is not None:
            size = float(np.ptp(self.body.points, axis=0).max())
            self._largest = float("inf"), max(self._largest[1], ROOM * size)
            self._flat_on = self._flat_below(self.rest)
        self._read_settings(config)
        lands = self.load is not None and self.load.flies and not self.load.held
        self.qualities = self.qualities or (LANDING if lands else QUALITIES)
        if "correction" in config:
            self.residual = contact_residual(checkpoint.arrays, config["correction"])
        # files of before bodies had a mass and a stiffness, and went on until they rest, have none of them
        self._young, self.free_from = float(config.get("young_kpa", 1.0)), config.get("free_from_s")
        self.settled_body: SettledBody | None = None
        self._ratios = 1.0, 1.0
        self._changed: Recent[ModalModel] = Recent(SETTLED)
        self._recent: Recent[tuple[ContactInputs, Vectors]] = Recent(1)

    # these take a moment, and not every object of a checkpoint is looked at

    @cached_property
    def validity(self) -> Validity:
        # mechanics loses energy by itself (that of the centre alone may grow, as when a body falls over), and what
        # bends too far comes back: its rigid motion goes on meanwhile
        validity = super().validity
        limits = replace(validity.limits, ends=False)
        if self.load is not None:
            limits = replace(limits, flat=True, depth=FLATTENED * float(np.ptp(self.body.points, axis=0).min()))
        return replace(validity, limits=limits)

    @property
    def mechanics(self) -> Mechanics:
        """The right-hand side of its ODE."""
        return self._mechanics if self.settled_body is None else self.settled_body.mechanics

    @cached_property
    def _mechanics(self) -> Mechanics:
        return Mechanics(self.body.reduced(), self.contact_parameters, self.projectile)

    @cached_property
    def _coordinates(self) -> tuple[Coordinates, Basis]:
        return coordinates_of(self.body)

    @property
    def coordinates(self) -> Coordinates:
        """Maps states of the mechanics to reduced coordinates."""
        return self._coordinates[0]

    @cached_property
    def space(self) -> ReducedSpace:
        """Reads the space of its coordinates."""
        # mechanics knows how far a body moves; only its deformation may get lost
        return space_of(self.body, self._coordinates[1], (float("inf"), self._largest[1]))

    @property
    def own_values(self) -> dict[str, float]:
        """Mass in kg and Young's modulus in kPa of the body as it was measured, of those that are parameters."""
        known = {MASS: self.body.solid.mass, YOUNG: self._young}
        return {p.name: known[p.name] for p in self.schema.parameters if p.name in known}

    @cached_property
    def solid(self) -> SoftObject | None:
        """Reads the solid of a user's own body that it was refined for; None for one of the scene's objects."""
        return item_in(self.checkpoint.arrays, self.checkpoint.config)

    def force_range(self, parameters: Mapping[str, Any]) -> tuple[float, float]:
        if self.solid is None:
            return super().force_range(parameters)
        return forces_in(self.solid, self.rest, parameters, self.load)

    def changed(self, parameters: Mapping[str, Any]) -> "ModalModel":
        """The model of this body with the mass and the stiffness that parameters give it."""
        own = self.own_values
        ratios = tuple(float(parameters.get(name, own[name])) / own[name] for name in own)
        mass, stiffness = (1.0 if abs(ratio - 1.0) < SAME else ratio for ratio in ratios or (1.0, 1.0))
        if (mass, stiffness) == self._ratios:
            return self
        return self._changed.get((mass, stiffness), lambda: self._with(mass, stiffness))

    def _with(self, mass: float, stiffness: float) -> "ModalModel":
        """Changes the body to so many times its mass and stiffness. Modes, coordinates and what was learned stay."""
        # a softer body deforms more before it is lost
        largest = self.space.largest[0], self.space.largest[1] / min(stiffness / self._ratios[1], 1.0)
        measured = self._measured_body  # and the coordinates that the space is made with: they stay for all such bodies
        out = copy(self)
        out._ratios, out._changed, out._recent = (mass, stiffness), Recent(SETTLED), Recent(1)
        for name in ("_loaded", "_pair", "_falling"):
            vars(out).pop(name, None)
        out.space = replace(self.space, largest=largest)
        if self.residual is not None:
            # what mechanics misses of the rigid motion are impulses, which move a heavier body less; a lighter one
            # leaves the sphere earlier, so that nothing says it misses more
            out.residual = replace(self.residual, rigid=min(1.0 / mass, 1.0))
        out.settled_body = None
        if (mass, stiffness) != (1.0, 1.0):
            coordinates, basis = self._coordinates
            out.settled_body = settled_body(
                self.body, self.contact_parameters, self.projectile, out._ratios, coordinates, basis
            )
            if self._flat_on is not None and not self._flies:
                # a heavy and soft body rests deeper than its own self, which it is not shown to
                out.settled_body = out.settled_body.above(self._flat_on)
        every = replace(measured.all, space=out.space)
        if (settled := out.settled_body) is not None:
            every = settled.basis(every, PointCloud(settled.rest.points))
        out.checked_body = replace(measured, all=every)
        return out

    @cached_property
    def _measured_body(self) -> CheckedBody:
        """The body as it was measured, for the checks of motions."""
        return super().checked_body

    def with_contact_parameters(self, contact_parameters: ContactParameters) -> "ModalModel":
        """The same bodies, which meet the floor in another way, and lie on it as before."""
        out = copy(self)
        out.contact_parameters, out._changed, out._recent = contact_parameters, Recent(SETTLED), Recent(1)
        if (settled := self.settled_body) is not None:
            out.settled_body = replace(settled, mechanics=replace(settled.mechanics, parameters=contact_parameters))
        for name in ("_loaded", "_mechanics", "_pair", "_falling"):
            vars(out).pop(name, None)
        return out

    def without_residual(self) -> "ModalModel":
        """The same bodies moved by mechanics alone, without what was regressed on its own body's motions."""
        out = copy(self)
        out.residual, out._changed, out._recent = None, Recent(SETTLED), Recent(1)
        return out

    def to_body_frame(self, geometry: Geometry, parameters: Mapping[str, Any]) -> Geometry:
        # a motion that begins in the air is that of the body where it would rest
        rest = self.settled(parameters)
        same = isinstance(geometry, Mesh) and np.array_equal(geometry.faces, rest.faces)
        return rest if self._flies and same else geometry

    def _flat_below(self, rest: Mesh) -> float | None:
        """The height below which a body of this rest shape is flat: one that begins there stays as it is."""
        floor = self.surroundings.floor if self.surroundings else None
        if floor is None:
            return None
        return floor - SKIN if self._flies else min(floor - SKIN, float(rest.points[:, 2].min()))

    def ground_of(self, parameters: Parameters) -> Ground | None:
        if self.load is None or self._flat_on is None:
            return None
        return Ground(self._flat_on, self.load.obstacles(parameters))

    def settled(self, parameters: Mapping[str, Any]) -> Mesh:
        found = self.changed(parameters).settled_body
        rest = self.rest if found is None else found.rest
        return self.shown(rest)

    def shown(self, geometry: Geometry) -> Any:
        return self._shapes.twins(geometry) if self._pairs else geometry

    def _solve(
        self,
        geometry: Geometry,
        parameters: Parameters,
        settings: SolverSettings | None,
        until: float,
        observed: MotionSequence | None,
    ) -> Motion:
        changed = self.changed(parameters)
        if not self._pairs:
            return super(ModalModel, changed)._solve(geometry, parameters, settings, until, observed)
        both, evaluated = self.shown(geometry), changed.evaluate_basis(self._shapes.one(geometry), 0.0)
        assert settings is not None
        solved = changed.integrate(changed.inputs(parameters), evaluated, settings, until)
        return pair_motion(changed, both, evaluated, parameters, solved, changed._loaded, changed._inside)

    def _solve_batch(
        self, geometry: Geometry, sets: list[dict[str, Any]], settings: SolverSettings | None, until: float
    ) -> MotionBatch:
        first = self.changed(sets[0])
        if self._pairs or any(self.changed(each) is not first for each in sets):
            return Predictor._solve_batch(self, geometry, sets, settings, until)
        return super(ModalModel, first)._solve_batch(geometry, sets, settings, until)

    def evaluate_basis(self, geometry: Geometry, azimuth: float) -> EvaluatedBasis:
        settled = self.settled_body
        if settled is None or not np.array_equal(geometry.points, settled.rest.points):
            return super().evaluate_basis(geometry, azimuth)

        def laid() -> EvaluatedBasis:
            return replace(self.checked_body.all, geometry=geometry, areas=surface_weights(self.rest))

        return self._evaluated.get((geometry_key(geometry), azimuth), laid)

    def _pushed(self, theta: Float[np.ndarray, "batch parameters"]) -> tuple[ContactInputs, Vectors]:
        """Returns what pushes at theta (B, P), relative to the mass centre of the body as it was measured, and the
        centres (B, 3) of the spheres at rest."""

        def found() -> tuple[ContactInputs, Vectors]:
            values = [[p.denormalise(float(x)) for p, x in zip(self.schema.learned, row, strict=True)] for row in theta]
            contacts, forces = np.split(np.array(values), [3], axis=1)
            known = [checked_contact(self.rest, *one) for one in zip(contacts, forces, strict=True)]
            points, normals = (np.stack([getattr(point, name) for point, _ in known]) for name in ("point", "normal"))
            centres = [centre for _, centre in known]
            if (settled := self.settled_body) is not None:
                places = [point.moved(settled.rest.points, self.rest.faces) for point, _ in known]
                centres = [checked_contact(settled.rest, *one)[1] for one in zip(places, forces, strict=True)]
            anchor = self.body.anchor
            return ContactInputs(points - anchor, normals, forces), np.stack(centres) - anchor

        return self._recent.get(theta.tobytes(), found)

    def _begin(self, theta: Float[np.ndarray, "batch parameters"]) -> Beginning:
        """The motions at theta (B, P), about to begin."""
        if self.load is not None:
            return self._loaded.begin([self._situation(row) for row in theta])
        inputs, centres = self._pushed(theta)
        push = make_push(self.mechanics.body, self.body.dynamic, inputs.contact, centres, inputs.force)
        return Beginning(push, self.mechanics.start(push), self.pulse)

    def _situation(self, theta: Floats) -> Situation:
        assert self.load is not None
        values = {p.name: p.denormalise(float(x)) for p, x in zip(self.schema.learned, theta, strict=True)}
        return self.load.situation(self.rest, values)

    @cached_property
    def _loaded(self) -> LoadedBody:
        """The body in mechanics that lets it fly and land."""
        (mass, stiffness), settled = self._ratios, self.settled_body
        body = self.body.reduced(SIDES).changed(mass, stiffness)
        rest = None if settled is None else settled.mechanics.rest
        free = None if self.body.free is None or not self._flies else np.sqrt(mass) * self.body.free
        parameters, stress = self.contact_parameters, stiffness / mass
        mechanics = Mechanics(body, parameters, self.projectile, stress, rest, free, lands=self._flies)
        turn = np.eye(3) if settled is None else settled.turn
        return LoadedBody(mechanics, self.body.dynamic, self.body.anchor, turn)

    @cached_property
    def _inside(self) -> Inside:
        """What another body meets of it."""
        body = self._loaded.mechanics.body
        return inside_of(Mesh(self.body.points - self.body.anchor, self.body.faces), body.support.points)

    @cached_property
    def _pair(self) -> Pair:
        """The right-hand side of two like bodies."""
        return Pair(self._loaded.mechanics, self._loaded.both, self._inside)

    def _readout(self, modes: Float[np.ndarray, "modes directions"]) -> Readout:
        """Reads out states in the directions of deformation of one push."""
        return Readout(self.coordinates.along(modes), self.settled_body, self._ratios[0] ** -0.5)

    def batch_inputs(self, sets: Sequence[Parameters]) -> Floats:
        # mechanics takes loads as they are asked for; what is regressed on pushes does not
        return super().batch_inputs(sets) if self.load is None else np.stack([self.schema.vector(one) for one in sets])

    def residual_inputs(self, theta: Floats) -> ContactInputs:
        return self._pushed(np.atleast_2d(theta))[0]

    def problem(self, theta: Floats, evaluated: EvaluatedBasis, dtype: type = np.float64) -> Problem:
        """States the problem of one push, for theta (P,) in [-1, 1]; always in double precision."""
        if self._pairs:
            return pair_problem(self._loaded, self._pair, self._situation(theta), self._falling)
        begun = self._begin(theta[None])
        pushed = PushedBody(self._moving, begun.push, begun.pulse)
        falls = self.load is not None and begun.push.modes is self._loaded.falling.modes
        read = self._falling if falls else self._readout(begun.push.modes[0])
        return Problem(pushed, begun.start[0], read, at_rest=begun.at_rest)

    @cached_property
    def _falling(self) -> Readout:
        """Reads out a body that nothing but the floor and obstacles touches."""
        return self._readout(self._loaded.falling.modes[0])

    @property
    def _moving(self) -> Mechanics:
        return self.mechanics if self.load is None else self._loaded.mechanics

    def batch_problem(
        self, theta: Floats, geometry: Geometry, azimuths: Times, dtype: type
    ) -> Callable[[], BatchProblem]:
        return lambda: self._together(theta)[0]

    def _together(self, theta: Float[np.ndarray, "batch parameters"]) -> tuple[BatchProblem, list[Readout]]:
        """The problem of many pushes, and the readout of each."""
        begun = self._begin(theta)
        bodies = pushed_bodies(self._moving, begun.push, begun.pulse)
        readouts = [self._readout(modes) for modes in begun.push.modes]

        def readout(times: Times, states: Floats) -> Floats:
            return np.stack([read(times, each) for read, each in zip(readouts, states, strict=True)])

        return BatchProblem(bodies, begun.start, readout, at_rest=begun.at_rest), readouts

    def trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> Trajectory:
        if self._flies:
            assert settings is not None
            problem = self.problem(theta, evaluated)
            read = problem.readout
            assert isinstance(read, Readout)
            solved = self._solved(problem, lambda: problem, settings, until)
            return BoundedTrajectory(solved, read.poses, *self._bounds)
        motion = self._motion(theta, evaluated, settings, until)
        return Adjusted(motion, self._projection(motion)) if self.load is None else motion

    @property
    def _bounds(self) -> tuple[Solid, float, float]:
        """The body that flies, the RMS deformation in m up to which it does as its law says, and seconds of a frame."""
        return self._moving.body.solid, LAWFUL * float(self.space.largest[1]), 1.0 / self.schema.window.rate

    def _motion(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> Trajectory:
        residual, free = self.residual, self.free_from
        if residual is None or free is None:
            return super().trajectory(theta, evaluated, settings, until)
        assert settings is not None
        problem = self.problem(theta, evaluated)
        inputs = self.residual_inputs(theta)
        first = self._solved(problem, lambda: problem, settings, free)
        corrected = Adjusted(first, residual.adjustment(first, inputs))

        def later() -> Trajectory:
            times, readout = before(free), problem.readout
            assert isinstance(readout, Readout)
            onward = problem._replace(start=readout.released(first.states(times), corrected.reduced(times)), begin=free)
            solved = self._solved(onward, lambda: onward, settings, until)
            return Adjusted(solved, residual.deformation_adjustment(inputs))

        return Piecewise(corrected, free, later)

    def batch_trajectory(
        self, geometry: Geometry, sets: Sequence[Parameters], settings: SolverSettings, until: float
    ) -> BatchTrajectory:
        if self._flies:  # energies are looked up a little ahead, for which all would be solved again
            until += LOOKED_AHEAD / self.schema.window.rate
        motion = self._motions(geometry, sets, settings, until)
        if self.load is None:
            return AdjustedBatch(motion, self._projection(motion))
        if not self._flies:
            return motion
        assert isinstance(motion, SolvedBatch)
        return BoundedBatch(motion, *self._bounds)

    def _motions(
        self, geometry: Geometry, sets: Sequence[Parameters], settings: SolverSettings, until: float
    ) -> BatchTrajectory:
        residual, free, least = self.residual, self.free_from, 1.0 / self.schema.window.rate
        if residual is None or free is None:
            return super().batch_trajectory(geometry, sets, settings, until)
        theta = np.stack([self.inputs(each) for each in sets])
        inputs = self.residual_inputs(theta)
        first = SolvedBatch(lambda: self._together(theta)[0], settings, free, least)
        corrected = AdjustedBatch(first, residual.adjustment(first, inputs))

        def later() -> BatchTrajectory:
            times = before(free)
            rows = first.states(times), corrected.reduced(times)
            starts = np.stack([read.released(*row) for read, *row in zip(self._together(theta)[1], *rows, strict=True)])

            def onward() -> BatchProblem:
                return self._together(theta)[0]._replace(start=starts, begin=free)

            return AdjustedBatch(SolvedBatch(onward, settings, until, least), residual.deformation_adjustment(inputs))

        return PiecewiseBatch(corrected, free, later)

    def _projection(self, motion: Moving) -> FloorProjection:
        body, window = self.checked_body, self.schema.window
        grid = np.linspace(window.start, window.stop, HEIGHTS * round(window.stop * window.rate) + 1)
        return FloorProjection(motion, lambda y: body.sample(y, np.ones(len(y))).lowest, self._least_height, grid)

    def _least_height(self, times: Times) -> Times:
        """(T,) m of the lowest point at (T,) s: in the window above what counts as lost, or where the body begins if
        that is lower, and some time after it nearly as it lies at rest. One that has fallen over would lie deeper, on
        a few springs that are linear."""
        body, stop = self.checked_body, self.schema.window.stop
        begins = float(body.all.rest[:, 2].min() + body.all.space.anchor[2])
        pushed = min(body.limit + SPARE, begins)
        return np.interp(times, [stop, stop + CALMS], [pushed, max(pushed, begins - SPARE)])
