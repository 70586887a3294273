"""A sequence as it is stored, and its frames at the rate of a data set."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from odeform.dataset.importers.even_steps import even_step
from odeform.dataset.resampling import even_times, is_even, resampled
from odeform.errors import InputError
from odeform.types import Faces, Frames, Times

__all__ = ["Read", "Recording", "common_rate", "frames_at"]

SAME = 1e-2  # relative: steps of rounded numbers that differ by less are one
MOST = 1_000_000  # frames

Read = Callable[[], tuple[Frames, Faces]]


@dataclass(frozen=True)
class Recording:
    """One sequence, not read yet.

    Attributes:
        where: What leads its messages.
        count: The number of its frames, T.
        read: Returns the frames (T, N, 3) and faces (F, 3). Raises `InputError` for damaged files.
        times: (T,) seconds, where the files say them; None where frames follow each other at the rate of the data set.
        counted: Whether `times` are integers, which count frames if a rate is given.
        step: The distance of the numbers in the names of frames; None for uneven or no numbers.
        decimal: Whether these numbers are decimals, which may be times.
        metric: Whether the files say their unit, so that the frames are in metres.
        notes: What was assumed or left out, for `frames_at` to put the names of sequences before.
        listed: The files of frames that a file of another name lists.
    """

    where: str
    count: int
    read: Read
    times: Times | None = None
    counted: bool = False
    step: float | None = None
    decimal: bool = False
    metric: bool = False
    notes: tuple[str, ...] = ()
    listed: tuple[Path, ...] = ()


def common_rate(recordings: Mapping[str, Recording], where: str) -> float:
    """The rate in Hz that the times of the first sequence have, where none is given.

    Raises `InputError`, which `where` leads, if any sequence has no times.
    """
    without = [(name, found) for name, found in recordings.items() if found.times is None]
    if without:
        name, found = without[0]
        hint = ""
        if found.decimal and found.step:
            hint = f"; {name} counts in steps of {found.step:g}: if these are seconds, --rate {_hertz(found.step)}"
        raise InputError(f"{where}: expected one rate in Hz, in a column 'rate' or by --rate, got none{hint}")
    times = next(iter(recordings.values()))
    even = even_times(np.asarray(times.times), times.where)
    return float(f"{1.0 / even[1]:.6g}")


def frames_at(
    rate: float, recordings: Mapping[str, Recording], given: bool
) -> tuple[dict[str, tuple[int, Read]], tuple[str, ...]]:
    """Number of frames and reader of each sequence at `rate` in Hz, and notes on what was assumed for it.

    Times that are integers count frames where the rate is `given`, and seconds where it is theirs.
    """
    found: dict[str, tuple[int, Read]] = {}
    names: dict[str, list[str]] = {}
    _require_one_step(recordings)
    for name, recording in recordings.items():
        if recording.times is None:
            found[name], doubt = (recording.count, recording.read), _doubt(recording, rate)
        else:
            count, read, doubt = _timed(recording, recording.times, rate, given)
            found[name] = count, read
        for note in (*recording.notes, doubt) if doubt else recording.notes:
            names.setdefault(note, []).append(name)
    return found, tuple(f"{_several(sequences)}: {note}" for note, sequences in names.items())


def _several(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"


def _require_one_step(recordings: Mapping[str, Recording]) -> None:
    """Numbers frames alike in all sequences of one rate."""
    steps = {name: found.step for name, found in recordings.items() if found.step is not None and found.times is None}
    if not steps:
        return
    first = next(iter(steps))
    for name, step in steps.items():
        if abs(step - steps[first]) > SAME * steps[first]:
            raise InputError(
                f"{recordings[name].where}: expected frames numbered as in {first}, in steps of {steps[first]:g}, got "
                f"steps of {step:g}: at one rate they would be at other times; are frames missing?"
            )


def _doubt(recording: Recording, rate: float) -> str:
    """Says how the numbers in the names contradict the rate; empty if they do not."""
    step = recording.step
    if recording.decimal and step is None:
        return (
            f"the numbers in the names are uneven; frames are taken {1 / rate:g} s apart, in their order. If they are "
            "times, list them in times.csv"
        )
    if recording.decimal and step and abs(1.0 / step - rate) > SAME * rate:
        return (
            f"the names count in steps of {step:g}; if these are seconds, the rate is {_hertz(step)} Hz, not {rate:g}"
        )
    if step and not recording.decimal and step != 1.0:
        return f"frames are numbered in steps of {step:g}; they are taken {1 / rate:g} s apart"
    return ""


def _hertz(step: float) -> str:
    return f"{float(f'{1.0 / step:.3g}'):g}"


def _timed(recording: Recording, times: Times, rate: float, given: bool) -> tuple[int, Read, str]:
    """Frames at the times of a data set, by splines where the files have others."""
    where = recording.where
    even = even_times(times, where)
    if recording.counted and given:
        names = [f"time {time:g}" for time in times]
        step = even_step(times - times[0], where, names, decimal=False, first=float(times[0]))
        if rate * (step or 1.0) != 1.0:
            note = f"the times are integers; they are taken to count frames, {1 / rate:g} s apart"
            return recording.count, recording.read, note
    if is_even(times, 1.0 / rate):
        return recording.count, recording.read, ""
    count = int(min(even[-1] * rate * (1.0 + 1e-9) + 1e-6, MOST + 1)) + 1
    if not 2 <= count <= MOST:
        raise InputError(f"{where}: expected from 2 to {MOST:,} frames at {rate:g} Hz, got {even[-1]:g} s")

    def read() -> tuple[Frames, Faces]:
        frames, faces = recording.read()
        return resampled(times, frames, np.arange(count) / rate, where), faces

    measured = f"{1 / even[1]:.4g} Hz" if is_even(times, even[1]) else f"uneven times, {1 / even[1]:.4g} Hz on average,"
    return count, read, f"resampled from {measured} to {rate:g} Hz"
