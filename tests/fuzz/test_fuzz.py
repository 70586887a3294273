"""A thousand damaged inputs, spread over all readers: each is read, or refused in one line."""

import pytest

from .run import case
from .targets import TARGETS, Target

CASES = 1000


@pytest.mark.parametrize("target", TARGETS, ids=lambda target: target.name)
def test_damaged_inputs_are_read_or_refused(target: Target) -> None:
    wrong = [case(target, 1, number) for number in range(-(-CASES // len(TARGETS)))]
    assert not any(wrong), next(filter(None, wrong))
