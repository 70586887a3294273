"""Work on several machines: a client of Dask, behind `odeform.parallel`.

A scheduler and workers are started with Dask's own commands. They may run anywhere; a command connects to the scheduler
and its parallel work is then done by the workers.
"""

# Not joblib's own Dask backend (1.6): it calls back only for tasks that finish, so that one which ended its workers is
# awaited forever; it stores large arguments on one worker, with which they are lost; and with it, work ran in this
# process after a worker had been killed.

import logging
import platform
import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from functools import partial
from importlib.metadata import version
from itertools import islice
from pathlib import Path
from typing import Any

from joblib import parallel_config
from threadpoolctl import threadpool_limits

from odeform.errors import InputError
from odeform.parallel import use_engine, workers_lost

__all__ = ["on_cluster"]

AHEAD = 2  # tasks in flight for each worker, so that none waits for the next
PATIENCE = 10.0  # s, for the scheduler to answer and for a first worker
COMPARED = ("odeform", "numpy", "scipy", "torch", "mujoco-core")  # what data and models depend on


@contextmanager
def on_cluster(address: str | None, shared: Path | None = None) -> Iterator[None]:
    """Meanwhile `odeform.parallel` works on the Dask cluster whose scheduler is at `address`, such as tcp://HOST:PORT.

    None leaves the work on this machine. `shared` is a folder that every worker must see, because it writes there.

    Raises:
        InputError: No scheduler or no worker there, or a worker that would compute something else: with several
            threads, other versions, or without the folder.
    """
    if address is None:
        yield
        return
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise InputError("--cluster: expected the package distributed: pip install 'odeform[cluster]'") from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # errors arrive as exceptions, too
    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(f"--cluster: no Dask scheduler at {address}: {error}") from None
    with client:
        _check(client, address, shared)
        with use_engine(partial(_as_completed, client)):
            yield


def _as_completed(
    client: Any, function: Callable[[Any], Any], items: Sequence[Any], batch_size: int
) -> Iterator[tuple[int, Any]]:
    """`odeform.parallel.as_completed` on the cluster. Dask repeats the tasks of a worker that ends."""
    from distributed import KilledWorker, as_completed
    from distributed.comm.core import CommClosedError

    starts = iter(range(0, len(items), batch_size))
    running = as_completed(loop=client.loop)

    def submit() -> None:
        free = max(AHEAD * len(client.nthreads()), 1) - running.count()  # workers come and go
        for start in islice(starts, max(free, 0)):
            batch = items[start : start + batch_size]
            running.add(client.submit(_batch, function, start, batch, pure=False))

    try:
        submit()
        for future in running:
            yield from future.result()
            submit()
    except (KilledWorker, CancelledError, CommClosedError) as error:
        raise workers_lost(error) from None


def _batch(function: Callable[[Any], Any], start: int, items: Sequence[Any]) -> list[tuple[int, Any]]:
    """Runs on a worker. A worker is one core; nested work is done there."""
    with threadpool_limits(1, "blas"), parallel_config(backend="sequential"):
        return [(start + index, function(item)) for index, item in enumerate(items)]


def _check(client: Any, address: str, shared: Path | None) -> None:
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError:
        raise InputError(f"--cluster: {address} has no workers: start some with `dask worker {address}`") from None
    for worker, threads in client.nthreads().items():
        if threads != 1:  # torch and BLAS have settings and random numbers by process
            raise InputError(f"--cluster: {worker}: expected one thread per worker (--nthreads 1), got {threads}")
    ours = _versions()
    for worker, theirs in _asked(client, _versions).items():
        if theirs != ours:
            raise InputError(f"--cluster: {worker}: expected {_listed(ours, theirs)}, got {_listed(theirs, ours)}")
    if shared is not None:
        with tempfile.NamedTemporaryFile(dir=shared, prefix=".odeform-") as token:
            for worker, sees in _asked(client, _sees, token.name).items():
                if not sees:
                    raise InputError(f"--cluster: {worker}: does not see {shared}: expected a shared folder")


def _asked(client: Any, function: Any, *args: str) -> dict[str, Any]:
    """Calls `function` on each worker; returns the answers by address."""
    try:
        return client.run(function, *args)
    except Exception as error:
        raise InputError(f"--cluster: a worker cannot run odeform: {type(error).__name__}: {error}") from None


def _versions() -> dict[str, str]:
    return {"python": platform.python_version(), **{name: version(name) for name in COMPARED}}


def _listed(versions: dict[str, str], others: dict[str, str]) -> str:
    return ", ".join(f"{name} {value}" for name, value in versions.items() if others.get(name) != value)


def _sees(path: str) -> bool:
    return Path(path).exists()
