"""Answers that nobody waits for any more."""

import threading

import pytest

from odeform.wanted import Unwanted, as_long_as, check_wanted


def test_work_is_given_up_once_unwanted() -> None:
    wanted = [True]
    check_wanted()
    with as_long_as(lambda: wanted[0]):
        check_wanted()
        wanted[0] = False
        with pytest.raises(Unwanted):
            check_wanted()
        with as_long_as(lambda: True):
            check_wanted()
    check_wanted()


def test_other_threads_are_left_alone() -> None:
    done = []

    def work() -> None:
        check_wanted()
        done.append(True)

    with as_long_as(lambda: False):
        thread = threading.Thread(target=work)
        thread.start()
        thread.join()
    assert done
