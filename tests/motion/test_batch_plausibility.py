"""Motions that are looked at together are found valid where each alone is."""

import numpy as np
import pytest

from odeform.motion.batch_plausibility import BatchPlausibility
from odeform.motion.limits import Limits
from odeform.motion.plausibility import PlausibilityCheck, Sample
from odeform.schema import Window
from odeform.types import Times

WINDOW = Window(0.5, 1.5, 60.0, 2.0)
LIMITS = Limits(floor=0.0)
SWING = 0.2  # m


def sample(times: Times, kind: str) -> Sample:
    """A body that swings up and down, 10 m above the ground: more after the window, and sinking at times."""
    swing = np.full(len(times), SWING)
    if kind.startswith("swings"):
        swing[times > WINDOW.stop] *= float(kind.split()[1])
    lowest = np.zeros(len(times))
    if kind == "dips":
        lowest[(times > 0.8) & (times < 0.9)] = -0.006
    if kind == "dips at the end":
        lowest[times > 1.48] = -0.006
    if kind == "sinks later":
        lowest[times > 2.2] = -0.006
    if kind == "is lost later":
        lowest[times > 2.2] = np.nan
    centre = np.zeros((len(times), 3))
    centre[:, 2] = 10.0 + swing * np.cos(np.pi * (times - WINDOW.stop))
    return Sample(lowest, 2.0 * (kind == "deforms") * (times > 1.0), centre)


KINDS = [
    *("is sound", "dips", "dips at the end", "sinks later", "is lost later", "deforms"),
    *(f"swings {factor}" for factor in (0.5, 1.02, 1.5, 2.0)),
]


@pytest.mark.parametrize("latest", [1.0, 1.5, 2.0, 2.5, 3.4])
def test_together_they_are_valid_where_each_alone_is(latest: float) -> None:
    def together(times: Times) -> Sample:
        each = [sample(times, kind) for kind in KINDS]
        return Sample(
            *(np.concatenate([getattr(s, name) for s in each]) for name in ("lowest", "deformation", "centre"))
        )

    batch = BatchPlausibility(LIMITS, WINDOW, len(KINDS), together)
    times = np.linspace(0.5, latest, 50)
    found, throughout = batch.valid(times, together(times)), batch.valid_throughout(latest)
    for index, kind in enumerate(KINDS):
        alone = PlausibilityCheck(LIMITS, WINDOW, lambda t, kind=kind: sample(t, kind))
        shown, stop = np.array_equal(alone.clamped(times), times), alone.first_stop(max(latest, WINDOW.stop))
        # after the window, many times are looked at together: what is wrong a little later counts already
        soon = alone.first_stop(latest + 0.5) is not None and latest > WINDOW.stop
        assert found[index] == (shown and not soon), kind
        assert throughout[index] == (stop is None and not soon), kind
    assert found[0]
    if latest > 2.4:
        assert set(np.array(KINDS)[found]) == {"is sound", "swings 1.02"}
