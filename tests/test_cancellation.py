"""Answers that nobody waits for any more."""

import threading

import pytest

from odeform.cancellation import Cancelled, cancel_unless, check_cancelled


def test_work_is_given_up_once_unwanted() -> None:
    wanted = [True]
    check_cancelled()
    with cancel_unless(lambda: wanted[0]):
        check_cancelled()
        wanted[0] = False
        with pytest.raises(Cancelled):
            check_cancelled()
        with cancel_unless(lambda: True):
            check_cancelled()
    check_cancelled()


def test_other_threads_are_left_alone() -> None:
    done = []

    def work() -> None:
        check_cancelled()
        done.append(True)

    with cancel_unless(lambda: False):
        thread = threading.Thread(target=work)
        thread.start()
        thread.join()
    assert done
