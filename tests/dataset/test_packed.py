import hashlib
import json
import lzma
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pushes import body, pushes
from safetensors.numpy import save

from odeform.dataset.folder import folder_reader, save_sequence
from odeform.dataset.index import Dataset, Entry
from odeform.dataset.integers import expanded, squeezed
from odeform.dataset.packed import open_packed, pack
from odeform.errors import InputError
from odeform.geometry.rigid import rotation_from_vector
from odeform.simulation.scenes.registry import get_scene
from odeform.types import MotionSequence

TOLERANCE = 2e-5  # m
FACES = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)


def tumbling(seed: int, frames: int = 31, rate: float = 120.0) -> MotionSequence:
    """A cloud of twelve points that flies, makes turns and wobbles in three modes."""
    rng, shape = np.random.default_rng(seed), np.random.default_rng(0)
    times = np.arange(frames) / rate
    rest, modes = 0.1 * shape.normal(size=(12, 3)), shape.normal(size=(3, 12, 3))
    local = rest + np.einsum("kt,kni->tni", 0.01 * np.sin(np.outer(rng.uniform(5.0, 30.0, 3), times)), modes)
    turned = local @ rotation_from_vector(times[:, None] * rng.normal(size=3) * 20.0).swapaxes(1, 2)
    vertices = turned + times[:, None, None] * rng.normal(size=3)
    return MotionSequence(times, vertices.astype(np.float32), FACES, np.full(12, 1.0 / 12.0))


def holding(*sequences: MotionSequence) -> Dataset:
    """A data set in memory: s0, s1, ..."""
    held = {f"s{k}": replace(sequence, name=f"s{k}") for k, sequence in enumerate(sequences)}
    entries = tuple(Entry(name, "train", {"mass": 0.5}) for name in held)
    return Dataset(Path("memory"), get_scene("kick").schema, entries, lambda entry: held[entry.name])


def largest(a: MotionSequence, b: MotionSequence) -> float:
    """Error of the worst vertex of the worst frame."""
    return float(np.linalg.norm(a.vertices.astype(float) - b.vertices, axis=2).max())


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    """Ten sequences in a folder, those of the test split at four times the rate."""
    root, splits = tmp_path_factory.mktemp("folder"), ["train"] * 7 + ["val"] + ["test"] * 2
    entries = []
    for k, split in enumerate(splits):
        sequence = tumbling(k, *((481, 480.0) if split == "test" else (121, 120.0)))
        digest = save_sequence(root, f"s{k}", sequence)
        entries.append(Entry(f"s{k}", split, {"mass": 0.5 + 0.1 * k}, digest))
    schema = get_scene("kick").schema
    return Dataset(root, schema, tuple(entries), folder_reader(root), {"radius_m": 0.1}, {"seed": 3})


@pytest.fixture(scope="module")
def path(dataset: Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("packed") / "kick.odp"
    pack(dataset, path, TOLERANCE)
    return path


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """Three tumbling clouds in one file."""
    pack(holding(*map(tumbling, range(3))), tmp_path / "small.odp", TOLERANCE)
    return tmp_path / "small.odp"


def test_motions_come_back_within_the_tolerance(dataset: Dataset, path: Path) -> None:
    packed = open_packed(path)
    for true, read in zip(dataset.sequences("all"), packed.sequences("all"), strict=True):
        assert largest(true, read) <= TOLERANCE
    assert path.stat().st_size < 0.1 * sum(file.stat().st_size for file in dataset.root.glob("*.npz"))


def test_everything_else_is_unchanged(dataset: Dataset, path: Path) -> None:
    packed = open_packed(path)
    assert (packed.schema, packed.fixed, packed.provenance) == (dataset.schema, dataset.fixed, dataset.provenance)
    assert [replace(e, sha256="") for e in packed.entries] == [replace(e, sha256="") for e in dataset.entries]
    for true, read in zip(dataset.sequences("all"), packed.sequences("all"), strict=True):
        assert (read.name, read.parameters) == (true.name, true.parameters)
        assert np.allclose(read.times, true.times, rtol=0.0, atol=1e-12)
        assert np.array_equal(read.faces, true.faces)
        assert np.allclose(read.weights, true.weights, rtol=0.0, atol=1e-12)
        assert read.vertices.dtype == np.float32


def test_sequences_keep_their_rate(path: Path) -> None:
    packed = open_packed(path)
    frames = {split: {len(s.times) for s in packed.sequences(split)} for split in ("train", "val", "test")}
    assert frames == {"train": {121}, "val": {121}, "test": {481}}


def test_lengths_may_differ(tmp_path: Path) -> None:
    """Scenes that end at rest end at different times."""
    made = [tumbling(0), tumbling(1, frames=57), tumbling(2, frames=4, rate=480.0)]
    pack(holding(*made), tmp_path / "a.odp", TOLERANCE)
    for true, read in zip(made, open_packed(tmp_path / "a.odp").sequences("all"), strict=True):
        assert np.allclose(read.times, true.times, rtol=0.0, atol=1e-12)
        assert largest(true, read) <= TOLERANCE


def test_several_turns(tmp_path: Path) -> None:
    """A rotation vector jumps where its angle is pi; the motion does not."""
    times = np.arange(121) / 120.0
    rest = tumbling(0).vertices[0].astype(float)
    vertices = rest @ rotation_from_vector(times[:, None] * [0.0, 30.0, 0.0]).swapaxes(1, 2)
    rolling = MotionSequence(times, vertices.astype(np.float32), FACES, np.full(12, 1.0 / 12.0))
    pack(holding(rolling), tmp_path / "a.odp", TOLERANCE)
    assert largest(rolling, next(open_packed(tmp_path / "a.odp").sequences("all"))) <= TOLERANCE


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-5, 1e-6])
def test_errors_are_within_the_tolerance_and_near_it(tmp_path: Path, tolerance: float) -> None:
    made = [tumbling(seed) for seed in range(4)]
    took = pack(holding(*made), tmp_path / "a.odp", tolerance)
    pairs = list(zip(made, open_packed(tmp_path / "a.odp").sequences("all"), strict=True))
    errors = [largest(true, read) for true, read in pairs]
    assert 0.1 * tolerance < max(errors) <= tolerance
    assert took["largest_error_m"] == pytest.approx(max(errors))
    rmse = max(np.sqrt(((read.vertices.astype(float) - true.vertices) ** 2).mean()) for true, read in pairs)
    assert took["largest_rmse_m"] == pytest.approx(rmse)


def test_a_looser_tolerance_takes_less_space(tmp_path: Path) -> None:
    sizes = []
    for tolerance in (1e-6, 1e-5, 1e-4):
        pack(holding(tumbling(0), tumbling(1)), tmp_path / "a.odp", tolerance)
        sizes.append((tmp_path / "a.odp").stat().st_size)
    assert sizes[0] > sizes[1] > sizes[2]


def test_every_object_has_its_own_mesh_and_modes(tmp_path: Path) -> None:
    made = pushes(10)
    took = pack(made, tmp_path / "a.odp", TOLERANCE)
    packed = open_packed(tmp_path / "a.odp")
    assert packed.objects == made.objects
    for name in made.objects:
        pairs = list(zip(made.sequences("all", name), packed.sequences("all", name), strict=True))
        assert max(largest(true, read) for true, read in pairs) <= TOLERANCE
        assert all(np.array_equal(read.faces, body(name).faces) for _, read in pairs)
        assert {len(read.times) for _, read in pairs} == {11, 41}
    assert set(took["bodies"]) == set(made.objects)
    assert 0.0 < took["rmse_m"] < took["largest_rmse_m"] < took["largest_error_m"] <= TOLERANCE
    with zipfile.ZipFile(tmp_path / "a.odp") as file:
        assert json.loads(lzma.decompress(file.read("dataset.json")))["codec"] == took


def test_a_vertex_that_modes_miss_is_corrected(tmp_path: Path) -> None:
    """One vertex leaves its neighbours for a single frame."""
    made = [tumbling(seed) for seed in range(4)]
    made[2].vertices[7, 3] += np.float32(0.01)
    pack(holding(*made), tmp_path / "a.odp", TOLERANCE)
    for true, read in zip(made, open_packed(tmp_path / "a.odp").sequences("all"), strict=True):
        assert largest(true, read) <= TOLERANCE


def test_a_later_version_is_refused(small: Path) -> None:
    with zipfile.ZipFile(small) as file:
        members = {name: file.read(name) for name in file.namelist()}
    with zipfile.ZipFile(small, "w") as file:
        for name, data in edited(members, b'"version": 2', b'"version": 3').items():
            file.writestr(name, data)
    assert "expected version 2 of the format, got 3" in refused(small)


def test_beyond_the_precision_of_the_data(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="tolerance is too small"):
        pack(holding(*map(tumbling, range(3))), tmp_path / "a.odp", 1e-12)
    assert not (tmp_path / "a.odp").exists()


def test_equal_data_give_equal_files(dataset: Dataset, path: Path, tmp_path: Path) -> None:
    pack(dataset, tmp_path / "again.odp", TOLERANCE)
    assert (tmp_path / "again.odp").read_bytes() == path.read_bytes()


def test_packs_a_packed_data_set(path: Path, tmp_path: Path) -> None:
    once = open_packed(path)
    pack(once, tmp_path / "twice.odp", TOLERANCE)
    twice = open_packed(tmp_path / "twice.odp")
    assert [e.name for e in twice.select("test")] == [e.name for e in once.select("test")]
    for one, two in zip(once.sequences("all"), twice.sequences("all"), strict=True):
        assert largest(one, two) <= TOLERANCE
        assert len(one.times) == len(two.times)


def test_a_file_may_replace_itself(small: Path) -> None:
    before = list(open_packed(small).sequences("all"))
    pack(open_packed(small), small, 1e-4)
    for one, two in zip(before, open_packed(small).sequences("all"), strict=True):
        assert largest(one, two) <= 1e-4


def test_failed_sequences_stay_listed(tmp_path: Path) -> None:
    made = holding(*map(tumbling, range(3)))
    failed = replace(made.entries[1], status="diverged")
    made = replace(made, entries=(made.entries[0], failed, made.entries[2]))
    pack(made, tmp_path / "a.odp", TOLERANCE)
    packed = open_packed(tmp_path / "a.odp")
    assert packed.entries[1] == failed
    assert [s.name for s in packed.sequences("all")] == ["s0", "s2"]
    with zipfile.ZipFile(tmp_path / "a.odp") as file:
        assert file.namelist() == ["dataset.json", "common", "s0", "s2"]


def test_sequences_are_read_independently(small: Path) -> None:
    packed = open_packed(small)
    true = packed.read(packed.entries[1])
    with zipfile.ZipFile(small) as file:
        spans = {i.filename: (i.header_offset + 30 + len(i.filename), i.compress_size) for i in file.infolist()}
    data = bytearray(small.read_bytes())
    for name in ("s0", "s2"):
        begin, size = spans[name]
        data[begin : begin + size] = bytes(size)
    small.write_bytes(data)
    damaged = open_packed(small)
    assert np.array_equal(damaged.read(damaged.entries[1]).vertices, true.vertices)
    for row in (0, 2):
        with pytest.raises(InputError):
            damaged.read(damaged.entries[row])


def refused(path: Path) -> str:
    """The error in one line of opening the file or reading a sequence."""
    with pytest.raises(InputError) as error:
        list(open_packed(path).sequences("all"))
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_flipped_bytes_are_noticed(small: Path) -> None:
    """Any flipped bit gives an error in one line, or has no effect."""
    whole, true = small.read_bytes(), [s.vertices for s in open_packed(small).sequences("all")]
    said = []
    for at in range(0, len(whole), 47):
        data = bytearray(whole)
        data[at] ^= 1 << at % 8
        small.write_bytes(data)
        try:
            read = [s.vertices for s in open_packed(small).sequences("all")]
        except InputError as error:
            said.append(str(error))
        else:
            assert all(np.array_equal(one, two) for one, two in zip(read, true, strict=True))
    assert all(line.startswith(f"{small}: ") and not line.endswith("None") for line in said)
    assert sum("damaged" in line for line in said) > 0.8 * len(range(0, len(whole), 47))


def test_an_exchanged_sequence_is_noticed(small: Path, tmp_path: Path) -> None:
    """Valid in itself, but not the sequence in the index."""
    with zipfile.ZipFile(small) as file, zipfile.ZipFile(tmp_path / "other.odp", "w") as other:
        for name in file.namelist():
            other.writestr(name, file.read("s2" if name == "s0" else name))
    assert "checksum of s0" in refused(tmp_path / "other.odp")


@pytest.mark.parametrize("keep", [0, 1, 30, 0.5, -22, -1])
def test_truncated(small: Path, keep: float) -> None:
    data = small.read_bytes()
    small.write_bytes(data[: round(keep * len(data)) if 0.0 < keep < 1.0 else int(keep)])
    assert "not a packed data set, or damaged" in refused(small)


def edited(members: dict[str, bytes], old: bytes, new: bytes) -> dict[str, bytes]:
    """With another text in the index."""
    index = lzma.decompress(members["dataset.json"])
    assert old in index
    return {**members, "dataset.json": lzma.compress(index.replace(old, new))}


def blob(content: bytes) -> Callable[[dict[str, bytes]], dict[str, bytes]]:
    """Replaces the first sequence by `content`, with a matching checksum."""

    def change(members: dict[str, bytes]) -> dict[str, bytes]:
        old, new = (hashlib.sha256(data).hexdigest().encode() for data in (members["s0"], content))
        return {**edited(members, old, new), "s0": content}

    return change


DAMAGE: dict[str, Callable[[dict[str, bytes]], dict[str, bytes]]] = {
    "no index": lambda members: {k: v for k, v in members.items() if k != "dataset.json"},
    "no common part": lambda members: {k: v for k, v in members.items() if k != "common"},
    "no sequence": lambda members: {k: v for k, v in members.items() if k != "s0"},
    "nothing": lambda members: {},
    "index is not compressed": lambda members: {**members, "dataset.json": lzma.decompress(members["dataset.json"])},
    "index is no JSON": lambda members: {**members, "dataset.json": lzma.compress(b"{")},
    "index of a folder": lambda members: edited(members, b"codec", b"x"),
    "quantum of nothing": lambda members: edited(members, b'"quantum_m": ', b'"quantum_m": -'),
    "common part is no safetensors": lambda members: {**members, "common": b"hello"},
    "common part of another": lambda members: {**members, "common": save({"points": np.zeros((3, 3))})},
    "sequence of nothing": blob(b""),
    "sequence of text": blob(b"hello"),
    "sequence without a rate": blob(squeezed(np.zeros((5, 18), dtype=np.int64), 0.0)),
    "sequence of another shape": blob(squeezed(np.zeros((5, 3), dtype=np.int64), 120.0)),
}


def test_refuses_compressed_members(small: Path) -> None:
    """Sizes are known before anything is decompressed."""
    with zipfile.ZipFile(small) as file:
        members = {name: file.read(name) for name in file.namelist()}
    with zipfile.ZipFile(small, "w", zipfile.ZIP_LZMA) as file:
        for name, data in members.items():
            file.writestr(name, data)
    refused(small)


@pytest.mark.parametrize("damage", DAMAGE)
def test_refuses_an_archive(small: Path, damage: str) -> None:
    with zipfile.ZipFile(small) as file:
        members = {name: file.read(name) for name in file.namelist()}
    with zipfile.ZipFile(small, "w") as file:
        for name, data in DAMAGE[damage](members).items():
            file.writestr(name, data)
    refused(small)


def test_refuses_other_files(tmp_path: Path) -> None:
    (tmp_path / "a.odp").write_text("hello")
    assert "not a packed data set" in refused(tmp_path / "a.odp")
    assert "No such file" in refused(tmp_path / "nothing.odp")
    assert "directory" in refused(tmp_path)


def smaller(sequence: MotionSequence) -> MotionSequence:
    return replace(sequence, vertices=sequence.vertices[:, :11], weights=np.full(11, 1.0 / 11.0))


def uneven(sequence: MotionSequence) -> MotionSequence:
    times = sequence.times.copy()
    times[3] += 1e-4
    return replace(sequence, times=times)


MISFITS: dict[str, tuple[Callable[[MotionSequence], MotionSequence], str]] = {
    "uneven frames": (uneven, "evenly spaced"),
    "late": (lambda s: replace(s, times=s.times + 0.1), "from time 0"),
    "fewer vertices": (smaller, "expected 12 vertices"),
    "other faces": (lambda s: replace(s, faces=s.faces[:, ::-1]), "same mesh"),
    "other weights": (lambda s: replace(s, weights=np.arange(1.0, 13.0) / 78.0), "same mesh"),
}


@pytest.mark.parametrize("misfit", MISFITS)
def test_refuses_a_misfit(tmp_path: Path, misfit: str) -> None:
    change, reason = MISFITS[misfit]
    with pytest.raises(InputError, match=f"s1: .*{reason}"):
        pack(holding(tumbling(0), change(tumbling(1)), tumbling(2)), tmp_path / "a.odp", TOLERANCE)
    assert list(tmp_path.iterdir()) == []


def test_nothing_to_pack(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no sequence"):
        pack(holding(), tmp_path / "a.odp")


STEPS = np.arange(400)
SERIES: dict[str, np.ndarray] = {
    "walk": np.cumsum(np.random.default_rng(0).integers(-9, 10, size=(400, 5)), axis=0),
    "noise": np.random.default_rng(1).integers(-(2**20), 2**20, size=(400, 3)),
    "large": np.random.default_rng(2).integers(-(2**31), 2**31, size=(50, 2)),
    "smooth": np.rint(1e5 * np.sin(np.outer(STEPS, [0.01, 0.05, 0.3]))).astype(np.int64),
    "large and smooth": np.rint(2.0**28 * np.cos(np.outer(STEPS, [0.01, 0.02]))).astype(np.int64),
    "each of another kind": np.stack([STEPS, STEPS**2, STEPS**3 // 50, 7 - 0 * STEPS, STEPS % 2], axis=1),
    "at rest": np.zeros((400, 4), dtype=np.int64),
    "one frame": np.array([[3, -4, 2**31 - 1, -(2**31)]]),
    "one series": STEPS[:, None] ** 2,
}


@pytest.mark.parametrize("kind", SERIES)
def test_integers_come_back_exactly(kind: str) -> None:
    values = SERIES[kind].astype(np.int64)
    again, rate = expanded(squeezed(values, 123.25))
    assert np.array_equal(again, values)
    assert rate == 123.25


def test_smooth_series_take_little_space() -> None:
    """The cheapest order of differences is chosen: the third difference of a slow sine nearly vanishes."""
    smooth = SERIES["smooth"][:, :1]
    shuffled = np.random.default_rng(0).permutation(smooth)
    assert len(squeezed(smooth, 120.0)) < 0.5 * len(squeezed(shuffled, 120.0))
