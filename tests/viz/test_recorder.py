"""A recording holds what was shown."""

from pathlib import Path

import numpy as np
import pytest
import rerun as rr

from odeform import InputError
from odeform.predictor import Predictor
from odeform_viz.columns import Column, Columns
from odeform_viz.recorder import Recorder
from odeform_viz.session import Session, Wish


def _record(kick: Predictor, path: Path, times: list[float]) -> list[np.ndarray]:
    session, columns = Session(kick.schema), Columns.of([Column("odeform", kick, kick.rest)]).all
    recorder = Recorder(path)
    shown = []
    for time in times:
        frame = session.frame(Wish(session.schema.complete({"mass": 0.4}), time, "balanced", columns))
        recorder.log(frame)
        column = frame.columns[0]
        shown.append(column.motion.deformed(time))
    recorder.close()
    return shown


def _columns(path: Path) -> dict[str, list]:
    """Component rows by entity and component name, read back from the file."""
    rows: dict[str, list] = {}
    for chunk in rr.chunk.RrdReader(str(path)).stream().to_chunks():
        batch = chunk.to_record_batch()
        for name in (n for n in batch.schema.names if ":" in n):  # components; the rest are timelines and row ids
            rows.setdefault(f"{chunk.entity_path}:{name}", []).extend(batch.column(name).to_pylist())
    return rows


def test_positions_parameters_and_provenance_read_back(kick: Predictor, tmp_path: Path) -> None:
    path = tmp_path / "session.rrd"
    shown = _record(kick, path, [0.0, 0.02, 0.5])
    rows = _columns(path)
    positions = next(v for k, v in rows.items() if "body" in k and "vertex_positions" in k)
    for expected, logged in zip(shown, positions, strict=True):
        np.testing.assert_array_equal(np.asarray(logged, dtype=np.float32), expected)
    faces = next(v for k, v in rows.items() if "triangle_indices" in k)
    assert len(faces) == 1  # static: once
    assert any(k.startswith("/parameters/mass") and "scalars" in k.lower() for k in rows)
    provenance = next(v for k, v in rows.items() if "provenance" in k and k.endswith(":text"))
    assert kick.checkpoint.sha256 in str(provenance)


def test_an_unwritable_place_is_refused_at_once(kick: Predictor, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="recording"):
        Recorder(tmp_path / "file" / "session.rrd")
