"""Runs one case, and says what went wrong with it."""

import resource
import signal
import sys
import tempfile
import traceback
from pathlib import Path
from typing import Any

import numpy as np

from odeform.errors import InputError

from .targets import Target

__all__ = ["case", "watch_for_code"]

LONGEST = 10  # s
MEMORY = 2 << 30  # bytes above those at the start
FORBIDDEN = ("os.system", "os.exec", "os.posix_spawn", "subprocess.Popen", "socket.connect", "ctypes.dlopen")


class Hang(BaseException):
    """A case takes too long. No reader catches it."""


class CodeRun(BaseException):
    """A file has started a program or a connection."""


def watch_for_code() -> None:
    """From now on, a reader that starts a program or opens a connection raises `CodeRun`."""

    def check(event: str, arguments: tuple[Any, ...]) -> None:
        if event in FORBIDDEN and _Watch.on:
            raise CodeRun(f"{event} {arguments}")

    sys.addaudithook(check)


class _Watch:
    on = False


def case(target: Target, seed: int, number: int) -> str:
    """Run case `number` of a target; returns what is wrong, with a traceback, or nothing."""
    random = np.random.default_rng([seed, number, sum(target.name.encode())])

    def hang(*_: object) -> None:
        raise Hang(f"longer than {LONGEST} s")

    before, signal_before = _memory(), signal.signal(signal.SIGALRM, hang)
    with tempfile.TemporaryDirectory(prefix="odeform-fuzz-") as folder:
        path = target.make(Path(folder), random)
        signal.alarm(LONGEST)
        _Watch.on = True
        try:
            target.use(path)
        except InputError as error:
            if "\n" in str(error) or len(str(error)) > 1000:
                return f"a message of {len(str(error))} characters in several lines"
        except (Exception, Hang, CodeRun):
            return traceback.format_exc()
        finally:
            _Watch.on = False
            signal.alarm(0)
            signal.signal(signal.SIGALRM, signal_before)
    used = _memory() - before
    return f"{used >> 20} MiB of memory" if used > MEMORY else ""


def _memory() -> int:
    """The largest that this process has been, in bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10
