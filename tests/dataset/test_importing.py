import csv
import functools
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh
from authors import TETRAHEDRON, write_sequence

from odeform.cli import main
from odeform.dataset.importers.natural_order import naturally_sorted
from odeform.dataset.importers.registry import IMPORTERS, Importer, import_dataset
from odeform.dataset.importers.source import Source, SourceSequence
from odeform.dataset.index import Dataset
from odeform.dataset.store import open_dataset
from odeform.errors import InputError

CORNERS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
FRAMES = 6


def shapes(seed: int, frames: int = FRAMES) -> np.ndarray:
    return 0.1 * CORNERS + 0.01 * np.random.default_rng(seed).normal(size=(frames, 4, 3))


def write_drops(root: Path, count: int = 10, splits: bool = True) -> None:
    """The authors' layout, frames numbered from 3; metadata longer than the sequence."""
    for k in range(count):
        params = {"mass": 0.2 + 0.1 * k, "soft_body_parameters": {"spring": {"bending": 3.0 - 0.2 * k}}}
        heights = np.concatenate([np.full(5, 9.0), 0.5 - 0.01 * np.arange(FRAMES)])
        write_sequence(root, f"drop_{k}", shapes(k), heights, params, first=3)
    if splits:
        for split, numbers in {"train": range(2, count), "val": [1], "test": [0]}.items():
            (root / f"{split}_folders.txt").write_text("".join(f"drop_{k}\n" for k in numbers))


def write_pushes(root: Path) -> None:
    rng = np.random.default_rng(0)
    for k in range(10):
        params = {"initial_location": rng.normal(size=3).tolist(), "contact_vector": rng.normal(size=3).tolist()}
        write_sequence(root, f"push_{k}", shapes(k), rng.normal(size=(FRAMES, 3)), params)


def by_split(dataset: Dataset) -> dict[str, list[str]]:
    return {split: [e.name for e in dataset.select(split)] for split in ("train", "val", "test")}


def test_natural_order() -> None:
    names = ["b_10.xyz", "b_9.xyz", "a_2.xyz", ".b_1.xyz", "b_100.xyz"]
    assert [p.name for p in naturally_sorted(map(Path, names))] == ["a_2.xyz", "b_9.xyz", "b_10.xyz", "b_100.xyz"]


def test_mass_elastic_of_the_authors(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_drops(tmp_path / "src")
    assert main(["import", str(tmp_path / "src"), "--out", str(tmp_path / "out")]) == 0
    assert "8 train, 1 val, 1 test; parameters: mass, bending; failed: none" in capsys.readouterr().out
    dataset = open_dataset(tmp_path / "out")
    assert dataset.schema.scene == "released-mass-elastic"
    assert dataset.schema.window.rate == 20.0
    assert dataset.schema.window.stop == pytest.approx((FRAMES - 1) / 20.0)
    assert dataset.fixed == {"initial_offset": 0.5}
    assert by_split(dataset)["train"] == [f"drop_{k}" for k in range(2, 10)]
    for sequence in dataset.sequences("all"):
        k = int(sequence.name[-1])
        wanted = shapes(k) + np.array([0.0, 0.0, 1.0]) * (0.5 - 0.01 * np.arange(FRAMES))[:, None, None]
        assert np.abs(sequence.vertices - wanted).max() < 1e-6
        assert np.array_equal(sequence.faces, TETRAHEDRON)
        assert sequence.parameters == pytest.approx({"mass": 0.2 + 0.1 * k, "bending": 3.0 - 0.2 * k})
        assert sequence.weights.sum() == pytest.approx(1.0)


def test_missing_splits_are_drawn_reproducibly(tmp_path: Path) -> None:
    write_drops(tmp_path / "src", splits=False)
    one, two, three = (import_dataset(tmp_path / "src", tmp_path / str(i), seed=s) for i, s in enumerate((0, 0, 1)))
    assert {split: len(names) for split, names in by_split(one).items()} == {"train": 7, "val": 1, "test": 2}
    assert by_split(one) == by_split(two) != by_split(three)
    assert one.provenance["split_seed"] == 0


def test_contact_force_of_the_authors(tmp_path: Path) -> None:
    write_pushes(tmp_path / "src")
    dataset = import_dataset(tmp_path / "src", tmp_path / "out")
    assert dataset.schema.scene == "released-contact-force"
    vectors = ("contact", "force", "initial_offset")
    assert [p.name for p in dataset.schema.parameters] == [f"{name}_{axis}" for name in vectors for axis in "xyz"]
    sequence = next(s for s in dataset.sequences("all") if s.name == "push_4")
    raw = json.loads((tmp_path / "src/push_4/metadata.json").read_text())
    assert np.abs(sequence.vertices - (shapes(4) + np.array(raw["rigid_pose_list"])[:, None])).max() < 1e-6


def test_a_sequence_that_cannot_be_read_is_listed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_drops(tmp_path / "src")
    (tmp_path / "src/drop_5/xyz_meshes/drop_5_6.xyz").write_text("1 2\n")
    assert main(["import", str(tmp_path / "src"), "--out", str(tmp_path / "out")]) == 0
    assert "failed: drop_5" in capsys.readouterr().out
    dataset = open_dataset(tmp_path / "out")
    assert "drop_5_6.xyz" in next(e.status for e in dataset.entries if e.name == "drop_5")


def test_errors_in_the_authors_layout(tmp_path: Path) -> None:
    write_drops(tmp_path / "good")

    def refused(match: str, name: str) -> None:
        with pytest.raises(InputError, match=match):
            import_dataset(tmp_path / name, tmp_path / "out")

    def copy(name: str) -> Path:
        return shutil.copytree(tmp_path / "good", tmp_path / name)

    (copy("json") / "drop_4/params.json").write_text("{")
    refused("not valid JSON", "json")
    (copy("keys") / "drop_4/params.json").write_text('{"mass": 1.0}')
    refused(r"params\.json: missing or wrong: 'soft_body", "keys")
    (copy("kind") / "drop_4/params.json").write_text("{}")
    refused("expected mass or contact_vector", "kind")
    (copy("short") / "drop_4/metadata.json").write_text('{"offset_z_vertices_list": [0.5]}')
    refused("1 heights for 6 frames", "short")
    (copy("lost") / "val_folders.txt").write_text("../good/drop_1x\n")
    refused("have no folder", "lost")
    (copy("twice") / "val_folders.txt").write_text("drop_3\n")
    refused("drop_3 is also in split train", "twice")
    write_pushes(copy("mixed"))
    for file in (tmp_path / "mixed").glob("*_folders.txt"):
        file.unlink()
    refused("import them separately", "mixed")
    refused("no such folder", "nowhere")
    (tmp_path / "empty").mkdir()
    refused(r"expected parameters.csv .*, or folders with params\.json", "empty")
    with pytest.raises(InputError, match="another folder than the source"):
        import_dataset(tmp_path / "good", tmp_path / "good")


def test_objects_of_different_meshes_are_refused(tmp_path: Path) -> None:
    write_drops(tmp_path / "src")
    folder = tmp_path / "src/drop_6"
    for file in (folder / "xyz_meshes").glob("*.xyz"):
        np.savetxt(file, np.loadtxt(file)[[0, 1, 2, 3, 3]])
    for file in folder.glob("*.ply"):
        trimesh.Trimesh(np.arange(15.0).reshape(5, 3), TETRAHEDRON, process=False).export(file)
    with pytest.raises(InputError, match=r"drop_6 has another mesh .*4 vertices.*5 vertices.*one object at a time"):
        import_dataset(tmp_path / "src", tmp_path / "out")


def write_meshes(root: Path, ending: str = "obj") -> list[dict[str, object]]:
    rows: list[dict[str, object]] = []
    for k in range(4):
        folder = root / f"take {k}"
        folder.mkdir(parents=True)
        for frame, shape in enumerate(shapes(k)):
            trimesh.Trimesh(shape, TETRAHEDRON, process=False).export(folder / f"f{frame + 95}.{ending}")
        rows.append(
            {"sequence": f"take {k}", "mass (kg)": 0.5 + k, "grip": 2.0, "split": ["train", "val", "test"][k % 3]}
        )
    return rows


def write_csv(path: Path, rows: list[dict[str, object]]) -> None:
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


@pytest.mark.parametrize(("ending", "table"), [("obj", "csv"), ("ply", "json")])
def test_mesh_frames(ending: str, table: str, tmp_path: Path) -> None:
    rows = write_meshes(tmp_path / "lab", ending)
    if table == "csv":
        write_csv(tmp_path / "lab/parameters.csv", rows)
        dataset = import_dataset(tmp_path / "lab", tmp_path / "out", rate=24.0)
    else:
        (tmp_path / "lab/parameters.json").write_text(json.dumps([{**row, "rate": 24} for row in rows]))
        dataset = import_dataset(tmp_path / "lab", tmp_path / "out")
    assert dataset.schema.scene == "imported-lab"
    (mass,) = dataset.schema.parameters
    assert (mass.name, mass.unit, mass.low, mass.high) == ("mass", "kg", 0.5, 3.5)
    assert dataset.fixed == {"grip": 2.0}
    assert dataset.schema.window.rate == 24.0
    assert by_split(dataset) == {"train": ["take 0", "take 3"], "val": ["take 1"], "test": ["take 2"]}
    for k, sequence in enumerate(dataset.sequences("all")):
        assert np.abs(sequence.vertices - shapes(k)).max() < 1e-6
        assert np.array_equal(sequence.faces, TETRAHEDRON)


def test_vertices_keep_the_order_of_the_file(tmp_path: Path) -> None:
    """Even where two coincide, and along texture seams: frames would not correspond otherwise."""
    rows = write_meshes(tmp_path / "lab")
    for k in range(4):
        for frame in range(FRAMES):
            corners = [*shapes(k)[frame], shapes(k)[frame][0]]
            lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in corners] + ["vt 0 0", "vt 1 0", "vt 0 1", "vt 1 1"]
            lines += ["f 1/1 3/2 2/3", "f 5/4 2/1 4/2", "f 1/2 4/3 3/4", "f 2/2 3/3 4/4"]
            (tmp_path / f"lab/take {k}/f{frame + 95}.obj").write_text("\n".join(lines))
    write_csv(tmp_path / "lab/parameters.csv", rows)
    dataset = import_dataset(tmp_path / "lab", tmp_path / "out", rate=10.0)
    for k, sequence in enumerate(dataset.sequences("all")):
        assert np.abs(sequence.vertices - shapes(k)[:, [0, 1, 2, 3, 0]]).max() < 1e-6


def test_a_layout_is_a_line_in_the_registry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A layout that only a test knows, of one array per sequence."""

    def source(root: Path, rate: float | None) -> Source:
        def read(k: int) -> tuple[np.ndarray, np.ndarray]:
            return np.load(root / f"{k}.npy"), TETRAHEDRON

        found = (SourceSequence(f"s{k}", {"mass": 1.0 + k}, FRAMES, functools.partial(read, k)) for k in range(4))
        return Source("arrays", rate or 10.0, tuple(found), {"mass": "kg"})

    for k in range(4):
        np.save(tmp_path / f"{k}.npy", shapes(k))
    importer = Importer("arrays", lambda root: (root / "0.npy").is_file(), source)
    monkeypatch.setitem(IMPORTERS, "arrays", importer)
    dataset = import_dataset(tmp_path, tmp_path / "out", rate=24.0)
    assert (dataset.schema.scene, dataset.schema.window.rate) == ("arrays", 24.0)
    assert all(np.allclose(s.vertices, shapes(k), atol=1e-6) for k, s in enumerate(dataset.sequences("all")))


def test_errors_in_a_table(tmp_path: Path) -> None:
    rows = write_meshes(tmp_path / "lab")

    def refused(match: str, rows: list[dict[str, object]], rate: float | None = 24.0) -> None:
        write_csv(tmp_path / "lab/parameters.csv", rows)
        with pytest.raises(InputError, match=match):
            import_dataset(tmp_path / "lab", tmp_path / "out", rate)

    refused("expected one rate in Hz", rows, None)
    refused("expected one rate in Hz", rows, -1.0)
    refused("no such folder", [{**rows[0], "sequence": "../lab/take 0"}, *rows[1:]])
    refused("each sequence only once", [rows[0], *rows])
    refused(r"mass \(kg\): expected a number, got 'much'", [{**rows[0], "mass (kg)": "much"}, *rows[1:]])
    refused("split: expected train, val, test", [{**rows[0], "split": "all"}, *rows[1:]])
    refused("column 'sequence'", [{"mass": 1.0}])
    refused("expected a parameter that varies, got constant mass, grip", rows[:1])
    next((tmp_path / "lab/take 1").glob("*.obj")).write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    write_csv(tmp_path / "lab/parameters.csv", rows)
    statuses = [e.status for e in import_dataset(tmp_path / "lab", tmp_path / "out", 24.0).entries]
    assert [status == "ok" for status in statuses] == [True, False, True, True]
