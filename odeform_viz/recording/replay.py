"""Checks a recording: computes every frame again from the checkpoints, and compares it with what was recorded."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import odeform
from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.types import Faces, Geometry, Mesh, PointCloud, Points
from odeform_viz.columns import Column, truth_column
from odeform_viz.recording.checked import CheckedColumn
from odeform_viz.recording.provenance import versions
from odeform_viz.recording.reader import Recording, read_recording
from odeform_viz.session import Session
from odeform_viz.view import ViewRequest

__all__ = ["TOLERANCE", "check_recording", "replay"]

TOLERANCE = 1e-5  # m


def replay(path: str | Path, tolerance: float = TOLERANCE) -> bool:
    """Check a recording and print the result. Returns whether all that can be computed agrees within `tolerance` m.

    `InputError` if the file is not a recording, or is damaged.
    """
    if not (np.isfinite(tolerance) and tolerance > 0.0):
        raise InputError(f"--tolerance: expected metres above 0, got {tolerance}")
    recording = read_recording(path)
    unfinished = ", not closed: its process was killed, or is still running" if recording.frames is None else ""
    print(f"{path}: {len(recording.requests)} frames{unfinished}")
    checked = check_recording(recording)
    for column in checked:
        print(f"  {column.describe()}")
    failure = _failure(recording, checked, tolerance)
    if not failure:
        print(f"all frames agree within {tolerance:g} m")
        return True
    print(f"error: {path}: {failure}", file=sys.stderr)
    now, then = versions(), recording.header["versions"]
    if others := [f"{name} {then.get(name)}, now {now[name]}" for name in now if then.get(name) != now[name]]:
        print(f"recorded with {'; '.join(others)}", file=sys.stderr)
    return False


def _failure(recording: Recording, checked: list[CheckedColumn], tolerance: float) -> str:
    """Says in one line what is wrong; empty if nothing is."""
    closed = recording.frames is not None
    if closed and recording.frames != len(recording.requests):
        return f"expected {recording.frames} frames, got {len(recording.requests)}"
    wrong = [column.label for column in checked if not column.agrees(tolerance, closed)]
    if wrong:
        return f"the result differs by more than {tolerance:g} m: {', '.join(wrong)}"
    return "" if any(column.frames for column in checked) else "none of its columns can be computed again"


def check_recording(recording: Recording) -> list[CheckedColumn]:
    """Compute each column of a recording again. `InputError` if the recording contradicts itself."""
    try:
        return _check(recording)
    except InputError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"recording {recording.path}: damaged: {error!r}") from None


def _check(recording: Recording) -> list[CheckedColumn]:
    columns, checked = _load_columns(recording)
    uses = _uses(recording)
    if missing := {name for name, _ in uses} - checked.keys():
        raise InputError(f"recording {recording.path}: no provenance of {', '.join(sorted(missing))}")
    session = Session(next(iter(columns.values())).source.schema) if columns else None
    for name, logged, points in recording.points():
        for frame in uses.pop((name, logged), ()):
            pose = recording.poses.get((name, frame))
            if name not in columns or session is None:
                continue
            if pose is None:
                checked[name].missing += 1
                continue
            request = _request(recording.requests[frame], tuple(columns.values()))
            computed = session.motion(columns[name], request).vertices(request.time)
            recorded = points @ pose[:3, :3].T + pose[:3, 3]
            checked[name].compare(frame, request.time, recorded, computed)
    for (name, _), frames in uses.items():
        checked[name].missing += len(frames)
    return list(checked.values())


def _uses(recording: Recording) -> dict[tuple[str, int], list[int]]:
    """Lists, for each column and frame in which its points were logged, the frames that show these points."""
    uses: dict[tuple[str, int], list[int]] = {}
    for frame, request in sorted(recording.requests.items()):
        for name, logged in request["columns"].items():
            uses.setdefault((name, logged), []).append(frame)
    return uses


def _request(raw: Mapping[str, Any], columns: tuple[Column, ...]) -> ViewRequest:
    return ViewRequest(dict(raw["parameters"]), float(raw["time"]), str(raw["quality"]), columns)


def _load_columns(recording: Recording) -> tuple[dict[str, Column], dict[str, CheckedColumn]]:
    """The columns that can be computed again, by name, and a result for every column."""
    models: dict[str, Predictor] = {}
    columns, checked = {}, {}
    for name, facts in sorted(recording.columns.items()):
        checked[name] = result = CheckedColumn(str(facts["label"]))
        if not str(facts["origin"]):
            simulated = bool(facts["truth"])
            result.skipped = "it is not from a data set" if simulated else "its model was not loaded from a file"
            continue
        if facts.get("own_body"):
            result.skipped = "the body that was made of its shape is in no file"
            continue
        try:
            column = _load_column(recording, name, facts, models)
        except (InputError, OSError) as error:
            result.problem = f"cannot be computed again: {error}"
            continue
        if column.predictor is not None:
            result.problem = _changed(column, str(facts["sha256"]))
            similarity = column.predictor.validity.similarity(column.geometry)
            result.note = "" if similarity is None or similarity.same else similarity.describe()
        if not result.problem:
            columns[name] = column
    return columns, checked


def _load_column(recording: Recording, name: str, facts: Mapping[str, Any], models: dict[str, Predictor]) -> Column:
    label, origin = str(facts["label"]), str(facts["origin"])
    # the shapes that a column has had share its key, so that the session keeps one motion of them
    key = int(name.partition("/")[0].removeprefix("column_"))
    if facts["truth"]:
        truth = truth_column(origin)
        return Column(label, truth.source, truth.geometry, key=key)
    model = models[origin] = models.get(origin) or odeform.load(origin)
    geometry = _geometry(recording.rest[name], recording.faces.get(name))
    return Column(label, model, geometry, pinned=facts["pinned"], origin=origin, key=key)


def _changed(column: Column, recorded: str) -> str:
    """Says that the checkpoint has changed; empty if not, or if only what motions do not depend on has."""
    assert column.predictor is not None
    checkpoint = column.predictor.checkpoint
    found = checkpoint.sha256
    if recorded in (found, *checkpoint.provenance.get("same_motions_as", ())):
        return ""
    return f"checkpoint {column.origin} has changed: expected SHA-256 {recorded[:16]}…, got {found[:16]}…"


def _geometry(points: Points, faces: Faces | None) -> Geometry:
    """The recorded shape; splats are compared by their centres, as points."""
    return PointCloud(points) if faces is None else Mesh(points, faces)
