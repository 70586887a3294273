"""Work in parallel: results by item, in order, and on any backend."""

import os
import threading
from functools import partial

import numpy as np
import pytest
from joblib import parallel_config
from threadpoolctl import threadpool_info, threadpool_limits

from odeform.errors import InputError
from odeform.parallel import as_completed, parallel_map


def square(value: int) -> int:
    return value**2


def describe(_: int) -> tuple[int, set[int]]:
    np.dot(np.ones((2, 2)), np.ones((2, 2)))
    return os.getpid(), {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def refuse(value: int) -> int:
    if value == 3:
        raise InputError("expected anything but 3")
    return value


def double(array: np.ndarray) -> np.ndarray:
    array *= 2.0
    return array


@pytest.mark.parametrize("workers", [1, 3])
@pytest.mark.parametrize("batch_size", [1, 4])
def test_results_are_in_the_order_of_the_items(workers: int, batch_size: int) -> None:
    with parallel_config(backend="threading"):
        assert parallel_map("test", square, range(10), workers, batch_size) == [value**2 for value in range(10)]


def test_no_items_give_no_results() -> None:
    assert parallel_map("test", square, []) == []
    assert list(as_completed(square, [], workers=2)) == []


def test_results_arrive_as_they_are_done() -> None:
    """The first item waits until the second one's result has been received."""
    received = threading.Event()

    def wait(index: int) -> int:
        if index == 0:
            assert received.wait(60.0)
        return index

    with parallel_config(backend="threading"):
        results = as_completed(wait, [0, 1], workers=2)
        assert next(results) == (1, 1)
        received.set()
        assert list(results) == [(0, 0)]


def test_one_worker_is_this_process_with_one_thread() -> None:
    with threadpool_limits(2, "blas"):
        ((_, (process, threads)),) = as_completed(describe, [0], workers=1)
        assert (process, threads) == (os.getpid(), {1})
        assert describe(0)[1] == {2}, "the caller's own limit is back"


@pytest.mark.slow
def test_workers_are_processes_with_one_thread_each() -> None:
    results = parallel_map("test", describe, range(6), workers=2)
    assert os.getpid() not in {process for process, _ in results}
    assert all(threads == {1} for _, threads in results)


@pytest.mark.slow
def test_workers_may_write_to_what_they_get() -> None:
    large = [np.ones(300_000), np.ones(300_000)]
    assert [float(done[0]) for done in parallel_map("test", double, large, workers=2)] == [2.0, 2.0]
    assert large[0][0] == 1.0


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_an_error_of_a_worker_is_the_callers(workers: int) -> None:
    with pytest.raises(InputError, match="anything but 3"):
        parallel_map("test", refuse, range(6), workers)


def test_the_backend_is_the_callers_choice() -> None:
    with parallel_config(backend="threading"):
        assert {process for process, _ in parallel_map("test", describe, range(4), workers=2)} == {os.getpid()}


def test_progress_counts_items(capsys: pytest.CaptureFixture[str]) -> None:
    parallel_map("squares", partial(square), range(3), workers=1)
    assert "squares: 3/3" in capsys.readouterr().err
