"""Long work in a process of its own, with progress, result and cancellation. The page stays responsive meanwhile."""

import contextlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from odeform.checkpoint import Checkpoint
from odeform.errors import InputError
from odeform.identification.identify import Identification
from odeform.identification.observation import Observation
from odeform.loads.registry import load_of_scene
from odeform.models.base import Predictor
from odeform.types import Geometry, MotionSequence, Times

if TYPE_CHECKING:
    from odeform.figure import Source
    from odeform.identification.pushed.evidence import Evidence
    from odeform.identification.pushed.recorded import Recorded
    from odeform.motion.recorded import RecordedMotion
    from odeform.stress.stability import StabilityMap

__all__ = [
    "JOB",
    "Job",
    "Lesson",
    "Report",
    "fit_body",
    "fit_parameters",
    "fit_push",
    "make_figure",
    "make_user_body",
    "map_stability",
    "refine_model",
    "simulate_lessons",
    "simulate_motion",
    "simulate_user_body",
]

JOB = "odeform-job"  # the name of the processes
POLITE = 10  # added to the niceness of long work
MAPPING = 15.0  # s of work on a map of stability; starting the process takes some more
Report = Callable[[Any], None]
"""Called with the progress of the work: the fraction that is done, 0 to 1, or what else the work says it is."""


@dataclass
class Job:
    """Runs `work(report, *args)` in a new process; `work` must be importable, its arguments and result picklable.

    `progress` is called with what the work reports, mostly the fraction done, then one of `done` with the result or
    `failed` with a message of one line. All are called from a thread of the job, and not after `cancel`.
    """

    work: Callable[..., Any]
    args: tuple[Any, ...]
    done: Callable[[Any], None]
    failed: Callable[[str], None]
    progress: Callable[[Any], None] = lambda _: None
    running: bool = field(default=False, init=False)
    """Until the result has arrived or the job is cancelled."""
    _cancelled: threading.Event = field(default_factory=threading.Event, init=False)
    _starting: threading.Lock = field(default_factory=threading.Lock, init=False)

    def start(self) -> None:
        """Start the process; returns at once. `failed` is called if the system has no room for another process."""
        with self._starting:  # a cancellation from another thread waits until there is a process to end
            try:
                self._start()
                return
            except OSError as error:
                self.running = False
                reason = f"no process could be started: {error.strerror}"
        self.failed(reason)

    def _start(self) -> None:
        self.running = True
        # spawn, not fork: this process has threads, and a fork would copy their locks in any state
        context = multiprocessing.get_context("spawn")
        self._inbox, outbox = context.Pipe(duplex=False)
        self._process = context.Process(target=_run, args=(outbox, self.work, self.args), name=JOB, daemon=True)
        self._process.start()
        outbox.close()
        self._thread = threading.Thread(target=self._listen, name=JOB, daemon=True)
        self._thread.start()

    def cancel(self) -> None:
        """Terminate the process. No callback follows."""
        with self._starting:
            if not self.running:
                return
            self._cancelled.set()
            self._process.terminate()
            self.running = False
        if threading.current_thread() is not self._thread:
            self._thread.join(timeout=5.0)

    def _listen(self) -> None:
        kind = "progress"
        while kind == "progress":
            try:
                kind, value = self._inbox.recv()
            except (EOFError, OSError):  # ended between two messages, or within one
                self._process.join(timeout=5.0)
                kind, value = "failed", f"the process {_ending(self._process.exitcode)}"
            if self._cancelled.is_set():
                return
            self.running = kind == "progress"
            {"progress": self.progress, "done": self.done, "failed": self.failed}[kind](value)
        self._process.join(timeout=5.0)


def _ending(code: int | None) -> str:
    if code is None or code >= 0:
        return f"ended with exit code {code}"
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
    hint = ", perhaps for lack of memory" if -code == signal.SIGKILL else ""
    return f"was ended by {name}{hint}"


def _run(outbox: Connection, work: Callable[..., Any], args: tuple[Any, ...]) -> None:
    threading.Thread(target=_end_with_viewer, name="odeform-parent", daemon=True).start()
    with contextlib.suppress(BrokenPipeError):  # the viewer was killed
        _send_result(outbox, work, args)


def _end_with_viewer() -> None:
    """End this process as soon as the viewer is gone, also one that was killed."""
    viewer = multiprocessing.parent_process()
    assert viewer is not None
    viewer.join()
    os._exit(1)


def _send_result(outbox: Connection, work: Callable[..., Any], args: tuple[Any, ...]) -> None:
    try:
        result = work(lambda fraction: outbox.send(("progress", fraction)), *args)
    except KeyboardInterrupt:
        return
    except BrokenPipeError:
        raise
    except Exception as error:
        outbox.send(("failed", f"{error}" if isinstance(error, InputError | RuntimeError | OSError) else f"{error!r}"))
    else:
        outbox.send(("done", result))


def simulate_motion(report: Report, scene: str, parameters: dict[str, float], rate: float) -> MotionSequence:
    """Simulate one motion of a scene under `parameters` (SI units), sampled at `rate` in Hz."""
    from odeform.simulation.scenes.registry import get_scene

    known = get_scene(scene)
    longer = {} if known.until is None else {"until": known.until}
    return known.simulate(parameters, rate=rate, report=report, **longer)


def simulate_user_body(
    report: Report, scene: str, item: Any, parameters: dict[str, Any], rate: float
) -> MotionSequence:
    """Simulates a motion of a soft object (`SoftObject`) that is none of the scene's; see `simulate_motion`."""
    from odeform.simulation.objects.settling import rested
    from odeform.simulation.scenes.contact_force import UNTIL, simulate_object
    from odeform.simulation.scenes.loaded import simulate_load

    load = load_of_scene(scene)
    if load is None:
        return simulate_object(rested(item), parameters, rate, report=report, until=UNTIL)
    return simulate_load(load, rested(item), parameters, rate, report=report, until=load.until)


def make_user_body(_: Report, geometry: Geometry, name: str, material: str | None = None) -> Any:
    """Makes a soft body of a shape (`UserBody`), of a material as `material_of` reads it."""
    from odeform.models.modal.user_body import user_body
    from odeform.simulation.objects.materials import material_of

    return user_body(geometry, name, material=None if material is None else material_of(material))


@dataclass(frozen=True)
class Lesson:
    """How far the teaching of a body is."""

    simulated: int
    motions: int
    """Of so many."""
    spent: float = 0.0
    """The fraction of the time for the refinement."""
    line: str = ""
    """What was last found."""


def simulate_lessons(report: Report, item: Any, like: str, folder: str, count: int) -> int:
    """Simulates `count` pushes of a soft object (`SoftObject`) into a folder, or what is left of them; returns how many
    it then holds. Reports a `Lesson` after each."""
    from odeform.simulation.user_data import simulate_item

    _give_way()

    def told(done: int, motions: int) -> None:
        report(Lesson(done, motions))

    dataset = simulate_item("contact-force", item, like, folder, count=count, report=told)
    return len(dataset.select("all"))


def refine_model(report: Report, start: str, folder: str, out: str, minutes: float) -> tuple[float, float, float]:
    """Refines a model for the body of a folder, or goes on with it; returns the error of the first guess and that of
    the refined model in mm on test motions, and the minutes of processor time that it took. Reports `Lesson`s."""
    from odeform.dataset.store import open_dataset
    from odeform.training.refine import refine

    _give_way()
    dataset = open_dataset(folder)
    motions = len(dataset.select("all"))
    line = ""

    def said(text: str) -> None:
        nonlocal line
        line = text

    def spent(fraction: float) -> None:
        report(Lesson(motions, motions, fraction, line))

    made = _finished(Path(out), start, len(dataset.select("train")))
    if made is None:
        resume = Path(f"{out}.part").exists()
        options = {"minutes": minutes, "report": said, "progress": spent}
        try:
            found = refine(dataset, out, start, resume=resume, **options)
        except InputError:
            if not resume:
                raise
            # what was interrupted learned from fewer motions
            found = refine(dataset, out, start, **options)
        made = found.checkpoint.provenance
    return made["refined"]["first_guess_mm"], made["refined"]["test_mm"], made["training_seconds"] / 60.0


def _finished(out: Path, start: str, motions: int) -> dict[str, Any] | None:
    """The provenance of a refinement of a model by so many motions, if it has ended."""
    from odeform.checkpoint import read_checkpoint

    if not out.exists():
        return None
    made = read_checkpoint(out).provenance
    known = made.get("refined", {})
    ended = "test_mm" in known and (known["from"], known["sequences"]) == (start, motions)
    return made if ended else None


def _give_way() -> None:
    """Let the page have the processor first."""
    if hasattr(os, "nice"):
        os.nice(POLITE)


def fit_parameters(report: Report, model: type[Predictor], checkpoint: Checkpoint, seen: Observation) -> Identification:
    """Estimate the parameters of an observed motion.

    Reports the fraction of a calibration that is done, then for each step its parameters and misfit.
    """
    from odeform.identification.identify import identify
    from odeform.identification.known import known_discrepancy

    predictor = model(checkpoint)
    misfits: list[float] = []
    discrepancy = known_discrepancy(predictor, report)
    return identify(predictor, seen, discrepancy, lambda theta: report((theta, misfits[-1])), misfits.append)


def _steps(report: Report) -> Callable[[dict[str, float], float], None]:
    """What reports the parameters and the misfit of each step."""
    return lambda parameters, misfit: report((parameters, misfit))


def _asked(report: Report, simulations: int) -> dict[str, Any]:
    """What is asked of a search beside the estimates: everything that it can tell is reported."""
    return {"propose": True, "simulations": simulations, "note": report, "estimated": report}


def fit_push(
    report: Report, predictor: Predictor, seen: "Evidence", known: dict[str, Any], simulations: int
) -> Identification:
    """Estimates how a pushed body is made and how it was pushed; reports the parameters and misfit of each step, and
    before each of up to `simulations` a sentence, and the estimates, before the next experiment is looked for."""
    from odeform.identification.pushed.identify import identify_push

    return identify_push(predictor, seen, known, None, _steps(report), **_asked(report, simulations))


def fit_body(
    report: Report, predictor: Predictor, experiments: "Sequence[Recorded]", known: dict[str, Any], simulations: int
) -> Identification:
    """Estimates how a body is made from experiments that are known; reports as `fit_push`."""
    from odeform.identification.pushed.identify import identify_body
    from odeform.identification.pushed.recorded import together_points

    made, seen = [one.made for one in experiments], together_points(experiments)
    return identify_body(predictor, made, seen, known, None, _steps(report), **_asked(report, simulations))


def map_stability(report: Report, checkpoint: str) -> "StabilityMap":
    """Maps where a model is stable, within the trained window and beyond."""
    from odeform.models.registry import load_continuous
    from odeform.stress.stability import refined_map

    return refined_map(load_continuous(checkpoint), MAPPING, report=report)


def make_figure(
    report: Report, sources: "Sequence[tuple[str, Source]]", times: Times, truth: "RecordedMotion | None"
) -> bytes:
    """Makes a figure with sliders of labelled models, and their error against a truth: a page of HTML."""
    from odeform.figure import column_bytes, figure_page, interpolated

    columns = []
    for label, source in sources:

        def tell(motions: int, most: int, _: float, before: int = len(columns)) -> None:
            # each refinement doubles the motions, and the last one takes as long as all before
            report((before + motions / most) / len(sources))

        columns.append(interpolated(label, source, times, column_bytes(len(sources)), tell))
    return figure_page(columns, truth)
