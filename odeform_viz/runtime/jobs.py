"""Long work in a process of its own: progress, result, cancel. The page stays alive, whatever the work does."""

import importlib.util
import multiprocessing
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.types import MotionSequence

__all__ = ["Job", "map_here", "simulate_here", "simulator_installed"]

Send = Callable[[float], None]


@dataclass
class Job:
    """Runs `work(send, *args)`, an importable function that calls `send` with its share done.

    `progress` is called with that share; at the end one of `done` with the result or `failed` with one line. All are
    called from a thread of the job's own, never again after `cancel`.
    """

    work: Callable[..., Any]
    args: tuple[Any, ...]
    done: Callable[[Any], None]
    failed: Callable[[str], None]
    progress: Callable[[float], None] = lambda _: None
    running: bool = field(default=False, init=False)
    """Until the result is in, or cancelled."""
    _cancelled: threading.Event = field(default_factory=threading.Event, init=False)

    def start(self) -> None:
        self.running = True
        # a fresh interpreter: this one has threads, whose locks a fork would copy as they happen to be
        context = multiprocessing.get_context("spawn")
        self._inbox, outbox = context.Pipe(duplex=False)
        self._process = context.Process(target=_run, args=(outbox, self.work, self.args), daemon=True)
        self._process.start()
        outbox.close()
        self._thread = threading.Thread(target=self._listen, name="odeform-job", daemon=True)
        self._thread.start()

    def cancel(self) -> None:
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
        result = work(lambda share: outbox.send(("progress", share)), *args)
    except KeyboardInterrupt:
        return
    except Exception as error:
        outbox.send(("failed", f"{error}" if isinstance(error, InputError | RuntimeError) else f"{error!r}"))
    else:
        outbox.send(("done", result))


def simulator_installed() -> bool:
    return importlib.util.find_spec("mujoco") is not None


def simulate_here(send: Send, scene: str, parameters: dict[str, float], rate: float) -> MotionSequence:
    """One motion of a scene under these parameters: the truth of that setting."""
    from odeform.simulation.scene import get_scene

    return get_scene(scene).simulate(parameters, rate=rate, report=send)


def map_here(send: Send, checkpoint: str) -> np.ndarray:
    """(H, W, 3) pixels: where a model is stable, within the window and beyond."""
    from odeform.models.registry import load_continuous
    from odeform.stress.stability import map_image, stability_map

    return np.asarray(map_image(stability_map(load_continuous(checkpoint), moments=(0.5, 1.0, 3.0))))
