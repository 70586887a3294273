"""A model is refined for a body that it was not trained on, by simulated motions of it."""

import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import odeform
from odeform.cli import main
from odeform.dataset.index import Dataset
from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.geometry.contact import nearest_on
from odeform.geometry.shape import FittedShape
from odeform.geometry.similarity import Similarity
from odeform.models.modal.elastic_body import elastic_body
from odeform.models.modal.loaded import ROOM
from odeform.models.modal.model import ModalModel
from odeform.models.modal.taught_body import TaughtBodyPredictor, item_of, taught
from odeform.models.modal.training import fit
from odeform.models.modal.training import refine as refining
from odeform.models.modal.user_body import UserBody, UserBodyPredictor
from odeform.models.per_object import PerObject
from odeform.models.registry import load
from odeform.simulation.contacts import vector_of
from odeform.simulation.objects.materials import forces_at
from odeform.simulation.user_data import body_in, simulate_item
from odeform.training import refine as refinement
from odeform.training.refine import refine
from tests.soft_block import block_object

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    """Twenty pushes of a block of 60 nodes."""
    out = tmp_path_factory.mktemp("taught") / "block"
    return simulate_item("contact-force", block_object(), "pillow", out, count=20, step=1e-3)


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fit, "MODES", (60, 60))
    monkeypatch.setattr(refining, "STARTS", 1)
    monkeypatch.setattr(refining, "EVALUATIONS", 4)


@pytest.fixture(scope="module")
def refined(dataset: Dataset) -> PerObject:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fit, "MODES", (60, 60))
        patch.setattr(refining, "STARTS", 1)
        patch.setattr(refining, "EVALUATIONS", 4)
        found = refine(dataset, dataset.root / "model.safetensors", "contact-force", report=lambda _: None)
    assert isinstance(found, PerObject)
    return found


def test_the_error_falls_to_less_than_half_of_the_first_guess(dataset: Dataset, refined: PerObject) -> None:
    made = refined.checkpoint.provenance["refined"]
    assert made["test_mm"] < 0.5 * made["first_guess_mm"]
    assert refined.schema.objects == ("block",)
    truth = next(dataset.sequences("test"))
    moved = refined.solve(None, truth.parameters).vertices(truth.times)
    rmse = 1e3 * float(np.sqrt(((moved - truth.vertices) ** 2).mean()))
    assert rmse < 3.0 * made["test_mm"]
    assert not (dataset.root / "model.safetensors.part").exists()


def test_the_checkpoint_holds_the_body_that_can_be_simulated(dataset: Dataset, refined: PerObject) -> None:
    body, item = body_in(dataset.root), item_of(refined, {"object": "block"})
    assert isinstance(part := refined.parts["block"], ModalModel)
    assert part.space.largest[1] >= ROOM * np.ptp(refined.rest.points, axis=0).max(), "few motions are no bound"
    assert body is not None
    assert item is not None
    assert np.array_equal(item.elements, body.item.elements)
    assert np.abs(item.settled - body.item.settled).max() < 1e-7
    assert refined.force_range({"object": "block"}) == body.item.forces
    given = refined.complete({"object": "block"})
    there = forces_at(item, nearest_on(refined.rest, vector_of(given, "contact")))
    assert refined.force_range(given) == there
    assert item_of(load("contact-force"), {"object": "donut"}) is None
    kicked = refined.under("kick")
    assert kicked.force_range({"object": "block"})[1] > body.item.forces[1]


def test_it_moves_the_shape_that_the_body_was_made_of(refined: PerObject) -> None:
    item = block_object()
    rest = item.rest_mesh()
    body = UserBody(item, elastic_body(item, 60), "pillow", FittedShape(rest, None, Similarity(), rest, None, 0.0))
    assert taught(refined, body)
    model = TaughtBodyPredictor(refined, body)
    guess = UserBodyPredictor(load("contact-force"), body)
    given = guess.complete(guess.parameters_like())
    there = {name: given[name] for name in ("object", *(f"{kind}_{a}" for kind in ("contact", "force") for a in "xyz"))}
    mine = model.solve(rest, there).vertices(0.1)
    assert np.abs(mine - refined.solve(rest, {**there, "object": "block"}).vertices(0.1)).max() < 1e-6
    with pytest.raises(InputError, match="was not taught"):
        TaughtBodyPredictor(load("contact-force"), body)


def test_what_ends_it_leaves_the_best_model_so_far_and_it_goes_on(
    dataset: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, kept, lines = tmp_path / "model.safetensors", [], []

    def killed(path: Path, *found: Any) -> None:
        kept.append(path)
        keep(path, *found)
        if len(kept) == 2:
            raise OSError(28, "No space left on device")

    keep = refinement._keep
    monkeypatch.setattr(refinement, "_keep", killed)
    with pytest.raises(OSError, match="No space left"):
        refine(dataset, out, "contact-force", report=lambda _: None)
    assert odeform.load(out).schema.objects == ("block",)
    monkeypatch.setattr(refinement, "_keep", keep)

    def again(*given: object, **more: object) -> None:
        raise AssertionError("contact parameters are fitted already")

    monkeypatch.setattr(refining, "fit_contact_parameters", again)
    found = refine(dataset, out, "contact-force", resume=True, report=lines.append)
    assert found.checkpoint.provenance["refined"]["test_mm"] > 0.0


def test_no_time_still_makes_a_model(dataset: Dataset, tmp_path: Path) -> None:
    spent: list[float] = []
    out = tmp_path / "model.safetensors"
    found = refine(dataset, out, "contact-force", minutes=1e-3, report=lambda _: None, progress=spent.append)
    assert isinstance(found, PerObject)
    assert spent[-1] == 1.0
    part = next(iter(found.parts.values()))
    assert getattr(part, "residual", None) is None, "no time was left to regress"


@pytest.mark.parametrize(
    ("data", "more", "expected"),
    [
        ("contact-force", "", "expected motions of a shape of your own"),
        ("{block}", "--from kick", "knows its trained bodies only"),
        ("{block}", "--model gp", "--model: not with --from"),
        ("{block}", "--minutes 0", "minutes: expected a positive number"),
        ("{block}", "--sequences 99", "sequences: expected 1 to 14, got 99"),
    ],
)
def test_other_data_and_options_are_refused_in_one_line(
    dataset: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str], data: str, more: str, expected: str
) -> None:
    command = ["train", data.format(block=dataset.root), "--from", "contact-force", "--out", str(tmp_path / "x")]
    assert main([*command, *more.split()]) == 2
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert expected in error
    assert open_dataset(dataset.root).entries


SCRIPT = """
import sys
from odeform.dataset.store import open_dataset
from odeform.models.modal.training import fit, refine as refining
from odeform.training.refine import refine

if sys.argv[3:]:
    import resource
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[3]),) * 2)
fit.MODES, refining.STARTS, refining.EVALUATIONS = (60, 60), 1, 4
refine(open_dataset(sys.argv[1]), sys.argv[2], "contact-force", report=lambda line: print(line, flush=True))
"""


def begun(dataset: Dataset, out: Path, *limit: str) -> subprocess.Popen[str]:
    """A refinement in a process of its own."""
    command = [sys.executable, "-c", SCRIPT, str(dataset.root), str(out), *limit]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.parametrize("step", ["first guess", "model 1", "model 2"])
def test_a_refinement_that_is_killed_goes_on_where_it_was(dataset: Dataset, tmp_path: Path, step: str) -> None:
    out = tmp_path / "model.safetensors"
    process = begun(dataset, out)
    with process:
        assert process.stdout is not None
        assert any(line.startswith(step) for line in process.stdout)
        process.kill()
        process.wait()
    assert process.returncode == -signal.SIGKILL
    resumed = Path(f"{out}.part").exists()
    found = refine(dataset, out, "contact-force", resume=resumed, report=lambda _: None)
    made = found.checkpoint.provenance["refined"]
    assert made["test_mm"] < 0.5 * made["first_guess_mm"]
    assert [path.name for path in tmp_path.iterdir()] == ["model.safetensors"] or not resumed


def test_a_full_disk_leaves_no_half_file(dataset: Dataset, tmp_path: Path) -> None:
    out = tmp_path / "model.safetensors"
    process = begun(dataset, out, "2000")
    _, said = process.communicate()
    assert process.returncode == 1
    assert "OSError" in said
    assert not out.exists()
    found = refine(dataset, out, "contact-force", report=lambda _: None)
    assert odeform.load(out).schema.objects == found.schema.objects


def test_a_simulation_that_is_killed_goes_on_where_it_was(tmp_path: Path) -> None:
    script = (
        "import sys; from odeform.simulation.user_data import simulate_item; from tests.soft_block import block_object;"
        "simulate_item('contact-force', block_object(), 'pillow', sys.argv[1], count=4, rate=50.0, step=1e-3,"
        "report=lambda done, count: print(done, flush=True))"
    )
    out = tmp_path / "block"
    root = str(Path(__file__).parents[2])
    process = subprocess.Popen([sys.executable, "-c", script, str(out)], stdout=subprocess.PIPE, text=True, cwd=root)
    with process:
        assert process.stdout is not None
        assert any(line.strip() == "2" for line in process.stdout)
        process.kill()
    told: list[int] = []
    item = block_object()
    options = {"count": 4, "rate": 50.0, "step": 1e-3}
    found = simulate_item("contact-force", item, "pillow", out, report=lambda done, _: told.append(done), **options)
    assert len(found.select("all")) == 4
    assert told[0] >= 1, "at most the motion in progress is lost, and one that was not listed yet"


def test_a_full_disk_while_motions_are_simulated_keeps_those_that_are_done(tmp_path: Path) -> None:
    script = (
        "import resource, sys; from odeform.simulation.user_data import simulate_item;"
        "from tests.soft_block import block_object;"
        "full = lambda done, _: done < 2 or resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100));"
        "simulate_item('contact-force', block_object(), 'pillow', sys.argv[1], count=4, rate=50.0, step=1e-3,"
        "report=full)"
    )
    out = tmp_path / "block"
    command = [sys.executable, "-c", script, str(out)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parents[2], check=False)
    assert done.returncode == 1
    assert "OSError" in done.stderr
    before = {entry.name: entry.sha256 for entry in open_dataset(out).entries}
    assert len(before) >= 1, "at most the motion in progress is lost, and one that was not listed yet"
    found = simulate_item("contact-force", block_object(), "pillow", out, count=4, rate=50.0, step=1e-3)
    assert len(found.select("all")) == 4
    assert before.items() <= {entry.name: entry.sha256 for entry in found.entries}.items()
    assert not list(out.glob("*.tmp*"))
