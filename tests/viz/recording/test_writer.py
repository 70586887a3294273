"""Recordings hold everything that was shown."""

import json
import re
import resource
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import rerun as rr
from scipy.spatial.transform import Rotation

from odeform import InputError
from odeform.geometry.shape import fit_to
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.simulation.scenes.registry import find_scene
from odeform.types import GaussianSplats, Mesh, PointCloud
from odeform_viz.columns import Column, Columns, truth_column
from odeform_viz.fitting import shape_from
from odeform_viz.recording import writer
from odeform_viz.recording.blueprint import make_blueprint
from odeform_viz.recording.control import RecordingControl
from odeform_viz.recording.modes import EXACT
from odeform_viz.recording.provenance import provenance_of
from odeform_viz.recording.reader import read_recording
from odeform_viz.recording.replay import check_recording
from odeform_viz.recording.writer import Recorder
from odeform_viz.session import Session
from odeform_viz.view import Frame, ViewRequest

Record = Callable[..., list[Frame]]


def _rows(path: Path) -> dict[str, list]:
    """Component rows by entity and component name, read back from the file."""
    rows: dict[str, list] = {}
    for chunk in rr.chunk.RrdReader(str(path)).stream().to_chunks():
        batch = chunk.to_record_batch()
        for name in (n for n in batch.schema.names if ":" in n):  # components; the rest are timelines and row ids
            some = [row for row in batch.column(name).to_pylist() if row]
            rows.setdefault(f"{chunk.entity_path}:{name}", []).extend(some)
    return rows


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "session.rrd"


def test_points_parameters_and_provenance_read_back(kick: Predictor, path: Path, record: Record) -> None:
    frames = record(path, [Column("odeform", kick, kick.rest, origin="kick")])
    points = {frame: points for _, frame, points in read_recording(path).points()}
    for index, frame in enumerate(frames):
        expected = frame.columns[0].motion.deformed(frame.request.time)
        np.testing.assert_allclose(points[index], expected, rtol=0.0, atol=EXACT)
    rows = _rows(path)
    faces = next(v for k, v in rows.items() if "column_0" in k and "triangle_indices" in k)
    assert len(faces) == 1  # static: once
    assert rows["/parameters/mass:Scalars:scalars"] == [[0.6]] * 3
    provenance = next(v for k, v in rows.items() if "provenance" in k and k.endswith(":text"))
    assert kick.checkpoint.sha256 in str(provenance)


def test_the_floor_is_there_and_the_arrow_while_it_pushes(kick: Predictor, path: Path, record: Record) -> None:
    frames = record(path, [Column("odeform", kick, kick.rest)], [0.0, 0.001, 0.5, 0.002])
    motion = frames[0].columns[0].motion
    (arrow,) = find_scene("kick").glyphs(motion.parameters, kick.rest.points)  # pyright: ignore[reportOptionalMemberAccess]
    rows = _rows(path)
    assert rows["/world/floor/plane:Mesh3D:vertex_positions"]
    assert arrow.begin <= 0.0
    assert arrow.end < 0.5
    assert rows["/world/column_0/form_0/arrows:Arrows3D:labels"] == [[arrow.label]] * 2  # before and after 0.5 s
    np.testing.assert_allclose(rows["/world/column_0/form_0/arrows:Arrows3D:vectors"][0][0], arrow.vector, rtol=1e-6)
    assert "/world/column_0/form_0/arrows:Clear:is_recursive" in rows


def test_each_unit_has_one_plot(kick: Predictor, path: Path, record: Record) -> None:
    record(path, [Column("odeform", kick, kick.rest)])
    columns = [SimpleNamespace(name="column_0/form_0", column=Columns.of([Column("odeform", kick, kick.rest)]).all[0])]
    blueprint = make_blueprint(columns)  # pyright: ignore[reportArgumentType]
    rows = blueprint.root_container.contents  # pyright: ignore[reportOptionalMemberAccess]
    results, parameters = ([view.name for view in row.contents] for row in list(rows)[1:])
    assert results == ["m", "mm", "ms", "evaluations"]
    assert parameters[:4] == ["mass: kg", "bending: N m", "force: N", "azimuth, elevation: rad"]


@pytest.mark.slow
def test_a_minute_of_playback_stays_small(kick: Predictor, path: Path) -> None:
    """Two seconds of it, after those in which all modes were added: the rest is more of the same."""
    columns, sizes = Columns.of([Column("odeform", kick, kick.rest, origin="kick")]).all, []
    session, recorder = Session(kick.schema), Recorder(path)
    for times in (np.linspace(0.0, 1.0, 150), np.linspace(0.0, 1.0, 150)):
        for time in times:
            recorder.log(session.frame(ViewRequest(kick.schema.complete({}), float(time), "balanced", columns)))
        recorder._write_taken()
        sizes.append(path.stat().st_size)
    recorder.close()
    assert sizes[1] - sizes[0] < 150 * 11_000  # bytes per frame, for 20 MB in 60 s at 30 Hz
    (checked,) = check_recording(read_recording(path))
    assert checked.frames == 300
    assert checked.error < 1e-6


def test_requests_and_shapes_read_back_exactly(kick: Predictor, path: Path, record: Record) -> None:
    times, parameters = (0.1 + 0.2, 1.0 / 3.0), {"mass": 0.1 + 0.3, "force": np.nextafter(100.0, 200.0)}
    frames = record(path, [Column("odeform", kick, kick.rest)], times, parameters)
    recording = read_recording(path)
    assert [request["time"] for request in recording.requests.values()] == list(times)
    assert recording.requests[0]["parameters"] == frames[0].request.parameters
    assert recording.frames == 2
    np.testing.assert_array_equal(recording.rest["column_0/form_0"], kick.rest.points)
    np.testing.assert_array_equal(recording.faces["column_0/form_0"], kick.rest.faces)
    np.testing.assert_allclose(recording.poses["column_0/form_0", 1], frames[1].columns[0].pose, atol=1e-7)
    assert set(recording.header["versions"]) >= {"odeform", "numpy", "torch", "rerun-sdk", "viser"}


def test_points_are_logged_only_when_the_body_deforms(kick: Predictor, path: Path, record: Record) -> None:
    record(path, [Column("odeform", kick, kick.rest)], [0.0, 0.0, 0.02, 0.02, 0.03])
    recording = read_recording(path)
    assert [frame for _, frame, _ in recording.points()] == [0, 2, 4]
    assert [request["columns"]["column_0/form_0"] for request in recording.requests.values()] == [0, 0, 2, 2, 4]
    assert len(recording.poses) == 5


def test_errors_curves_and_statistics_are_time_series(path: Path, record: Record) -> None:
    truth = truth_column("mass-elastic/" + _a_test_sequence())
    model = _load("mass-elastic")
    columns = [Column("odeform", model, model.rest, origin="mass-elastic"), truth]
    assert truth.truth is not None
    frames = record(path, columns, [0.31, 0.35], dict(truth.truth.parameters))
    rows = _rows(path)
    errors = [frame.columns[0].error for frame in frames]
    for quantity in ("rmse_mm", "mae_mm", "worst_mm"):
        logged = rows[f"/errors/{quantity}/column_0/form_0:Scalars:scalars"]
        assert logged == [[getattr(error, quantity)] for error in errors]
    stats = frames[0].columns[0].stats
    assert rows["/statistics/evaluations/column_0/form_0:Scalars:scalars"] == [[stats.evaluations]] * 2
    assert rows["/statistics/wall_ms/column_0/form_0:Scalars:scalars"] == [[stats.wall_ms]] * 2
    assert stats.status in str(rows["/status/column_0/form_0:TextLog:text"])
    for column in ("column_0", "column_1"):
        assert len(rows[f"/curves/height_m/{column}/form_0:Scalars:scalars"]) == 2
        assert len(rows[f"/curves/deformation_mm/{column}/form_0:Scalars:scalars"]) == 2


def _a_test_sequence() -> str:
    from odeform.dataset.store import open_dataset

    return open_dataset("mass-elastic").select("test")[0].name


def _load(name: str) -> Predictor:
    import odeform

    return odeform.load(name)


def test_any_label_makes_a_valid_entity(
    kick: Predictor, path: Path, record: Record, capfd: pytest.CaptureFixture[str]
) -> None:
    labels = ["kick at 0.4 kg", "kick #2", "kick/pod-rbf (no azimuth)", "Ärger: %$!\\"]
    record(path, [Column(label, kick, kick.rest) for label in labels])
    assert "WARN" not in capfd.readouterr().err
    assert [column["label"] for _, column in sorted(read_recording(path).columns.items())] == labels


def test_the_blueprint_has_a_3d_view_for_each_column(kick: Predictor, path: Path, record: Record) -> None:
    record(path, [Column("one", kick, kick.rest), Column("two", kick, kick.rest)])
    reader = rr.chunk.RrdReader(path)
    chunks = [chunk for store in reader.blueprints() for chunk in reader.stream(store=store).to_chunks()]
    texts = [
        str({name: batch.column(name).to_pylist() for name in batch.schema.names if ":" in name})
        for batch in (chunk.to_record_batch() for chunk in chunks)
    ]
    assert len(reader.blueprints()) == 1
    for key, label in enumerate(("one", "two")):
        assert any(f"world/column_{key}/**" in text for text in texts)
        assert any(label in text and "DisplayName" not in label for text in texts)
    assert any("TimeSeries" in text for text in texts)


def test_another_shape_is_another_entity_and_hidden_columns_are_cleared(kick: Predictor, path: Path) -> None:
    columns = Columns.of([Column("one", kick, kick.rest), Column("two", kick, kick.rest)])
    session, recorder = Session(kick.schema), Recorder(path)
    request = ViewRequest(kick.schema.complete({}), 0.02, "balanced", columns.all)
    recorder.log(session.frame(request))
    columns.set_visible(1, False)
    recorder.log(session.frame(replace(request, columns=columns.all)))
    columns.set_visible(1, True)
    columns.set_shape(fit_to(PointCloud(kick.rest.points[:50]), kick.rest))
    recorder.log(session.frame(replace(request, columns=columns.all)))
    recorder.close()
    recording = read_recording(path)
    shown = [set(request["columns"]) for request in recording.requests.values()]
    assert shown[0] == {"column_0/form_0", "column_1/form_0"}
    assert shown[1] == {"column_0/form_0"}
    assert shown[2] == {"column_0/form_1", "column_1/form_1"}
    assert recording.columns["column_0/form_1"]["geometry"] == "points"
    assert recording.columns["column_0/form_1"]["shape"]["place"]["factor"] > 0.0
    assert "/world/column_1/form_0:Clear:is_recursive" in _rows(path)


def test_files_are_named_by_absolute_path(kick: Predictor, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "model.safetensors").write_bytes(b"")
    monkeypatch.chdir(tmp_path)
    origin = provenance_of(Column("model", kick, kick.rest, origin="model.safetensors"))["origin"]
    assert origin == str(tmp_path / "model.safetensors")
    assert provenance_of(Column("model", kick, kick.rest, origin="kick/pod-rbf"))["origin"] == "kick/pod-rbf"
    json.dumps(provenance_of(Column("model", kick, kick.rest, pinned={"mass": 0.5})))


def test_each_recording_has_an_id_of_its_own(kick: Predictor, tmp_path: Path, record: Record) -> None:
    ids = set()
    for name in ("one.rrd", "two.rrd"):
        record(tmp_path / name, [Column("odeform", kick, kick.rest)])
        ids.add(rr.chunk.RrdReader(tmp_path / name).recordings()[0].recording_id)
    assert len(ids) == 2


def test_an_unwritable_path_is_refused_at_once(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="recording"):
        Recorder(tmp_path / "file" / "session.rrd")


@pytest.fixture
def small_files() -> Iterator[None]:
    """Limit files to 400 kB, as a full disk would."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, hard))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.usefixtures("small_files")
def test_a_full_disk_is_reported_and_earlier_frames_read_back(
    kick: Predictor, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writer, "FLUSH", 0.0)
    columns = Columns.of([Column("odeform", kick, kick.rest)]).all
    session, recorder = Session(kick.schema), Recorder(path)

    def record_all() -> None:
        for time in np.linspace(0.01, 0.1, 20):
            recorder.log(session.frame(ViewRequest(kick.schema.complete({}), float(time), "balanced", columns)))

    with pytest.raises(InputError, match="can no longer be written"):
        record_all()
    recording = read_recording(path)
    assert 0 < len(recording.requests) == recorder.frames - 1
    assert recording.frames is None


@pytest.mark.usefixtures("small_files")
def test_a_disk_that_is_full_long_before_it_is_noticed_does_not_hang(kick: Predictor, path: Path) -> None:
    columns = Columns.of([Column("odeform", kick, kick.rest)]).all
    session, recorder = Session(kick.schema), Recorder(path)
    recorder._written_at = float("inf")  # nothing is written until the end
    for time in np.linspace(0.01, 0.9, 100):
        recorder.log(session.frame(ViewRequest(kick.schema.complete({}), float(time), "balanced", columns)))
    failed = []

    def close() -> None:
        with pytest.raises(InputError, match="File too large") as error:
            recorder.close()
        failed.append(error)

    closing = threading.Thread(target=close, daemon=True)
    closing.start()
    closing.join(60.0)
    assert failed
    assert read_recording(path).requests == {}


def test_nothing_is_overwritten(path: Path) -> None:
    path.write_text("precious")
    with pytest.raises(InputError, match="the file exists"):
        Recorder(path)
    with pytest.raises(InputError, match=r"ending in \.rrd"):
        Recorder(path.with_suffix(".txt"))
    assert path.read_text() == "precious"


def test_only_what_somebody_watches_is_recorded(kick: Predictor, path: Path) -> None:
    columns = Columns.of([Column("odeform", kick, kick.rest)]).all
    frame = Session(kick.schema).frame(ViewRequest(kick.schema.complete({}), 0.1, "balanced", columns))
    watched = False
    control = RecordingControl(path, lambda: watched)
    assert not control.sync()
    control.log(frame)
    watched = True
    assert control.sync()  # the frame on screen has to be shown again
    assert not control.sync()
    control.log(frame)
    control.close()
    assert list(read_recording(path).requests) == [0]


@pytest.mark.slow
def test_the_still_part_of_a_scene_is_logged_once(kick: Predictor, path: Path, record: Record) -> None:
    fit = shape_from("volleyball", kick.rest)
    record(path, [Column(name, kick, fit.geometry, fit=fit, origin="kick") for name in ("a", "b")])
    rows = _rows(path)
    (points,) = rows["/world/still/splats:GaussianSplats3D:centers"]
    assert fit.static is not None
    assert len(points) == len(fit.static.points)
    (shape,) = {str(facts["shape"]) for facts in read_recording(path).columns.values()}
    assert "volleyball" in shape


def test_the_status_says_what_is_wrong_with_a_shape_and_a_motion(path: Path, record: Record) -> None:
    model = load("kick/gp")  # whose continuation lets this motion sink
    flat = Mesh(model.rest.points * np.float32([1.0, 1.0, 0.6]), model.rest.faces)
    sinking = {"mass": 1.3, "bending": 0.335, "force": 39.7, "azimuth": 0.0, "elevation": 0.947}
    columns = [Column("flat", model, flat), Column("ball", model, model.rest)]
    record(path, columns, [0.0, 3.5], sinking)
    rows = _rows(path)
    said = {name: str(rows[f"/status/{name}/form_0:TextLog:text"]) for name in ("column_0", "column_1")}
    assert "this shape was not trained" in said["column_0"]
    assert "not trained" not in said["column_1"]
    for text in said.values():
        assert re.search(r"stopped at t = [23]\.\d+ s: it sinks into the floor afterwards", text)


def test_a_mesh_keeps_its_own_colors(kick: Predictor, path: Path, record: Record) -> None:
    colors = np.tile(np.array([10, 20, 30], dtype=np.uint8), (len(kick.rest.faces), 3, 1))
    fit = fit_to(Mesh(kick.rest.points, kick.rest.faces, colors), kick.rest)
    record(path, [Column("odeform", kick, fit.geometry, fit=fit)])
    ((rgba, *_),) = _rows(path)["/world/column_0/form_0/body:Mesh3D:vertex_colors"]
    assert rgba == 0x0A141EFF


def test_splats_keep_their_shapes_and_colours(kick: Predictor, path: Path, record: Record) -> None:
    rng, points = np.random.default_rng(2), kick.rest.points[::9]
    count = len(points)
    sizes, turns = np.exp(rng.uniform(-7.0, -4.0, (count, 3))), Rotation.random(count, random_state=3)
    half = turns.as_matrix() * sizes[:, None]
    splats = GaussianSplats(
        points, half @ half.swapaxes(1, 2), 0.2 * rng.standard_normal((count, 9, 3)), rng.uniform(0.1, 1.0, count)
    )
    fit = fit_to(splats, kick.rest)
    body = fit.geometry
    assert isinstance(body, GaussianSplats)
    (_, frame, *_) = record(path, [Column("odeform", kick, body, origin="kick", fit=fit)])
    rows = _rows(path)
    name = "/world/column_0/form_0/body:GaussianSplats3D"
    assert not any(key.startswith("/world/column_0/form_0/body:Points3D") for key in rows)
    np.testing.assert_allclose(rows[f"{name}:centers"][0], frame.columns[0].motion.deformed(0.0), atol=1e-6)
    quaternions, scales = np.array(rows[f"{name}:quaternions"][0]), np.array(rows[f"{name}:scales"][0])
    half = Rotation.from_quat(quaternions).as_matrix() * scales[:, None]
    np.testing.assert_allclose(half @ half.swapaxes(1, 2), body.covariances, rtol=1e-4, atol=1e-9)
    (further,) = rows[f"{name}:sh_coefficients"]
    np.testing.assert_allclose(np.array(further)[:, :8], body.harmonics[:, 1:], atol=2e-3)
    assert not np.array(further)[:, 8:].any()
    (colors,) = rows[f"{name}:colors"]
    rgba = np.array(colors, dtype=np.uint32)[:, None] >> np.array([24, 16, 8, 0]) & 255
    np.testing.assert_allclose(rgba, 255.0 * np.column_stack([body.colors, body.opacities]), atol=0.51)
