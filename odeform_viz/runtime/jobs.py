"""Long work in a process of its own, with progress, result and cancellation. The page stays responsive meanwhile."""

import multiprocessing
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.types import MotionSequence

__all__ = ["Job", "Report", "simulate_motion", "stability_image"]

Report = Callable[[float], None]
"""Called with the fraction of the work that is done, 0 to 1."""


@dataclass
class Job:
    """Runs `work(report, *args)` in a new process; `work` must be importable, its arguments and result picklable.

    `progress` is called with the fraction done, then one of `done` with the result or `failed` with a message of one
    line. All are called from a thread of the job, and not after `cancel`.
    """

    work: Callable[..., Any]
    args: tuple[Any, ...]
    done: Callable[[Any], None]
    failed: Callable[[str], None]
    progress: Callable[[float], None] = lambda _: None
    running: bool = field(default=False, init=False)
    """Until the result has arrived or the job is cancelled."""
    _cancelled: threading.Event = field(default_factory=threading.Event, init=False)

    def start(self) -> None:
        """Start the process; returns at once."""
        self.running = True
        # spawn, not fork: this process has threads, and a fork would copy their locks in any state
        context = multiprocessing.get_context("spawn")
        self._inbox, outbox = context.Pipe(duplex=False)
        self._process = context.Process(target=_run, args=(outbox, self.work, self.args), daemon=True)
        self._process.start()
        outbox.close()
        self._thread = threading.Thread(target=self._listen, name="odeform-job", daemon=True)
        self._thread.start()

    def cancel(self) -> None:
        """Terminate the process. No callback follows."""
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
            except EOFError:
                self._process.join(timeout=5.0)
                kind, value = "failed", f"the process ended with exit code {self._process.exitcode}"
            if self._cancelled.is_set():
                return
            self.running = kind == "progress"
            {"progress": self.progress, "done": self.done, "failed": self.failed}[kind](value)
        self._process.join(timeout=5.0)


def _run(outbox: Connection, work: Callable[..., Any], args: tuple[Any, ...]) -> None:
    try:
        result = work(lambda fraction: outbox.send(("progress", fraction)), *args)
    except KeyboardInterrupt:
        return
    except Exception as error:
        outbox.send(("failed", f"{error}" if isinstance(error, InputError | RuntimeError) else f"{error!r}"))
    else:
        outbox.send(("done", result))


def simulate_motion(report: Report, scene: str, parameters: dict[str, float], rate: float) -> MotionSequence:
    """Simulate one motion of a scene under `parameters` (SI units), sampled at `rate` in Hz."""
    from odeform.simulation.scenes.registry import get_scene

    return get_scene(scene).simulate(parameters, rate=rate, report=report)


def stability_image(report: Report, checkpoint: str) -> np.ndarray:
    """The stability plot of a model, (H, W, 3) pixels: where it is stable, within the trained window and beyond."""
    from odeform.models.registry import load_continuous
    from odeform.stress.stability import map_image, stability_map

    return np.asarray(map_image(stability_map(load_continuous(checkpoint), moments=(0.5, 1.0, 3.0))))
