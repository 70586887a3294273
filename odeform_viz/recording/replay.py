"""A recording checked: every frame computed again from the checkpoints, and compared with what was shown."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import odeform
from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.types import Faces, Geometry, Mesh, PointCloud, Points
from odeform_viz.columns import Column, truth_column
from odeform_viz.recording.provenance import versions
from odeform_viz.recording.reader import Recording, read_recording
from odeform_viz.session import Session
from odeform_viz.view import ViewRequest

__all__ = ["TOLERANCE", "Checked", "check_recording", "replay"]

TOLERANCE = 1e-5  # m


@dataclass(eq=False)
class Checked:
    """One column of a recording: how many `frames` were compared, and where it was `off` most, in metres.

    `missing` counts frames that it is in but whose points are not in the file. `skipped` says why it cannot be
    computed again, `problem` why it is not what was recorded, whatever its frames say.
    """

    label: str
    frames: int = 0
    off: float = 0.0
    frame: int = 0
    time: float = 0.0
    vertex: int = 0
    missing: int = 0
    skipped: str = ""
    problem: str = ""

    def compare(self, frame: int, time: float, shown: Points, again: Points) -> None:
        """Points (N, 3) in metres, as they were shown and as they come out now."""
        self.frames += 1
        if shown.shape != again.shape:
            self.problem = f"{len(shown)} points were shown, {len(again)} come out now"
            return
        distances = np.nan_to_num(np.linalg.norm(shown - again, axis=1), nan=np.inf)
        worst = int(distances.argmax())
        if self.frames == 1 or distances[worst] > self.off:
            self.off, self.frame, self.time, self.vertex = float(distances[worst]), frame, time, worst

    def agrees(self, tolerance: float, ended: bool) -> bool:
        """A recording that was not ended may lack something of its last frames."""
        lacks = self.missing and (ended or not self.frames)
        return not self.problem and self.off <= tolerance and not lacks

    def describe(self) -> str:
        if self.skipped or (self.problem and not self.frames):
            return f"{self.label}: {self.problem or f'skipped, {self.skipped}'}"
        text = f"{self.label}: {self.frames} frames"
        if self.frames:
            text += f", at most {self.off:.2g} m off (frame {self.frame}, t = {self.time:.4f} s, vertex {self.vertex})"
        if self.missing:
            text += f"; of {self.missing} more there are no points"
        return f"{text}; {self.problem}" if self.problem else text


def check_recording(recording: Recording) -> list[Checked]:
    """Each column of the recording, computed again. `InputError` for a recording that contradicts itself."""
    try:
        return _check(recording)
    except InputError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"recording {recording.path}: damaged: {error!r}") from None


def _check(recording: Recording) -> list[Checked]:
    columns, checked = _columns(recording)
    wanted = _wanted(recording)
    if lost := {name for name, _ in wanted} - checked.keys():
        raise InputError(f"recording {recording.path}: nothing says what {', '.join(sorted(lost))} is")
    session = Session(next(iter(columns.values())).source.schema) if columns else None
    for name, sent, points in recording.points():
        for frame in wanted.pop((name, sent), ()):
            pose = recording.poses.get((name, frame))
            if name not in columns or session is None:
                continue
            if pose is None:
                checked[name].missing += 1
                continue
            request = _wish(recording.requests[frame], tuple(columns.values()))
            again = session.motion(columns[name], request).vertices(request.time)
            shown = points @ pose[:3, :3].T + pose[:3, 3]
            checked[name].compare(frame, request.time, shown, again)
    for (name, _), frames in wanted.items():
        checked[name].missing += len(frames)
    return list(checked.values())


def _wanted(recording: Recording) -> dict[tuple[str, int], list[int]]:
    """For points by name and the frame they were sent in, the frames that show them."""
    wanted: dict[tuple[str, int], list[int]] = {}
    for frame, request in sorted(recording.requests.items()):
        for name, sent in request["columns"].items():
            wanted.setdefault((name, sent), []).append(frame)
    return wanted


def _wish(raw: Mapping[str, Any], columns: tuple[Column, ...]) -> ViewRequest:
    return ViewRequest(dict(raw["parameters"]), float(raw["time"]), str(raw["quality"]), columns)


def _columns(recording: Recording) -> tuple[dict[str, Column], dict[str, Checked]]:
    """The columns that can be computed again, by name, and an account of all."""
    models: dict[str, Predictor] = {}
    columns, checked = {}, {}
    for name, facts in sorted(recording.columns.items()):
        # shapes that one column had in turn share a key, so that no more than one motion of it is kept
        key = int(name.partition("/")[0].removeprefix("column_"))
        checked[name] = account = Checked(str(facts["label"]))
        origin = str(facts["origin"])
        if not origin:
            account.skipped = "simulated on the spot" if facts["truth"] else "of a model that was not read from a file"
            continue
        try:
            if facts["truth"]:
                column = truth_column(origin)
                column = Column(account.label, column.source, column.geometry, key=key)
            else:
                model = models[origin] = models.get(origin) or odeform.load(origin)
                account.problem = _changed(origin, str(facts["sha256"]), model.checkpoint.sha256)
                geometry = _geometry(recording.rest[name], recording.faces.get(name))
                column = Column(account.label, model, geometry, pinned=facts["pinned"], key=key)
        except (InputError, OSError) as error:
            account.problem = f"cannot be computed again: {error}"
            continue
        if not account.problem:
            columns[name] = column
    return columns, checked


def _changed(origin: str, recorded: str, found: str) -> str:
    if recorded == found:
        return ""
    return f"checkpoint {origin} is not what it was: expected SHA-256 {recorded[:16]}…, got {found[:16]}…"


def _geometry(points: Points, faces: Faces | None) -> Geometry:
    """Splats are checked by their centres, as points."""
    return PointCloud(points) if faces is None else Mesh(points, faces)


def replay(path: str | Path, tolerance: float = TOLERANCE) -> bool:
    """Check a recording and print what came out; whether all that can be computed again lies within metres given."""
    if not (np.isfinite(tolerance) and tolerance > 0.0):
        raise InputError(f"--tolerance: expected metres above 0, got {tolerance}")
    recording = read_recording(path)
    ended = recording.frames is not None
    print(
        f"{path}: {len(recording.requests)} frames" + ("" if ended else ", not ended: the process was killed, or runs")
    )
    checked = check_recording(recording)
    for column in checked:
        print(f"  {column.describe()}")
    why = _verdict(recording, checked, tolerance)
    if not why:
        print(f"computed again, all lie within {tolerance:g} m")
        return True
    print(f"error: {path}: {why}", file=sys.stderr)
    now, then = versions(), recording.header["versions"]
    if others := [f"{name} {then.get(name)}, now {now[name]}" for name in now if then.get(name) != now[name]]:
        print(f"recorded with {'; '.join(others)}", file=sys.stderr)
    return False


def _verdict(recording: Recording, checked: list[Checked], tolerance: float) -> str:
    """What is wrong in one line; empty if nothing is."""
    ended = recording.frames is not None
    if ended and recording.frames != len(recording.requests):
        return f"it ended with {recording.frames} frames, but has {len(recording.requests)}"
    wrong = [column.label for column in checked if not column.agrees(tolerance, ended)]
    if wrong:
        return f"not what comes out now within {tolerance:g} m: {', '.join(wrong)}"
    return "" if any(column.frames for column in checked) else "nothing in it can be computed again"
