"""Says in words what has to be known of a motion before using it."""

import numpy as np

from odeform.loads.registry import known_as
from odeform.motion.base import Motion
from odeform.types import Times

__all__ = ["caveats"]


def caveats(motion: Motion, times: Times) -> tuple[str, ...]:
    """One sentence each: a shape that was not trained, parameters and (T,) `times` in seconds outside the trained
    range (under a load, that in which errors were measured), and where the motion is clamped because it is not
    physically possible. Empty if there is none of them."""
    return (
        *_shape(motion),
        *_parameters(motion),
        *_moment(motion, times),
        *_times(motion, times),
        *_stop(motion, times),
    )


def _shape(motion: Motion) -> list[str]:
    similarity = motion.similarity
    if similarity is None or similarity.same:
        return []
    return [f"{similarity.describe()}; {motion.validity.untrained}"]


def _parameters(motion: Motion) -> list[str]:
    ranges, known = {p.name: p for p in motion.schema.parameters}, known_as(motion.schema.scene)
    return [
        f"{name} = {motion.parameters[name]:g} {p.unit} is outside the {known} range, {p.low:g} to {p.high:g} {p.unit}"
        for name, p in ranges.items()
        if name in motion.outside
    ]


def _moment(motion: Motion, times: Times) -> list[str]:
    others = 0 if motion.only_at is None else int((np.abs(times - motion.only_at) > 1e-6).sum())
    if not others:
        return []
    return [
        f"only the state at {motion.only_at:.3g} s is predicted: {others} of {len(times)} frames are not predictions"
    ]


def _times(motion: Motion, times: Times) -> list[str]:
    later = sum(motion.extrapolates(float(time)) for time in times)
    if not later:
        return []
    window = motion.schema.window
    end = window.stop + window.reach * (window.stop - window.start)
    still = f"; soon after {end:.3g} s it stands still" if float(np.max(times)) > end else ""
    which = f"{later} of {len(times)} frames are" if len(times) > 1 else f"t = {float(times[0]):.4g} s is"
    return [
        f"{which} outside the {known_as(motion.schema.scene)} window, {window.start:g} to {window.stop:g} s: "
        f"there the motion is extrapolated{still}"
    ]


def _stop(motion: Motion, times: Times) -> list[str]:
    stop = motion.stop_at(float(times[0])) if len(times) == 1 else motion.first_stop(float(np.max(times, initial=0.0)))
    if stop is None:
        return []
    return [f"the motion is {stop}"]
