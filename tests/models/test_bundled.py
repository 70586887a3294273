"""Every checkpoint that comes with the package opens, and predicts finite points."""

import numpy as np
import pytest

from odeform.checkpoint import bundled_checkpoints
from odeform.models.names import ALIASES
from odeform.models.registry import load
from odeform.types import PointCloud


def test_every_scene_has_its_rivals_in_few_bytes() -> None:
    """So that the page compares without a training, and an install stays small."""
    sizes = {name: path.stat().st_size for name, path in bundled_checkpoints().items()}
    for scene in ("contact-force", "kick", "mass-elastic"):
        assert {f"{scene}/{model}" for model in ("gp", "nearest", "odeform", "pod-rbf")} <= sizes.keys()
    networks = {f"contact-force/{model}" for model in ("node", "odeform-per-point", "pe-gnn", "rnn")}
    assert networks <= sizes.keys(), "the paper's among them"
    assert sum(size for name, size in sizes.items() if name.startswith("contact-force/")) < 40e6
    assert sum(sizes.values()) < 60e6


@pytest.mark.parametrize("name", bundled_checkpoints())
def test_it_opens_and_predicts(name: str):
    predictor = load(name)
    scene, _, model = name.partition("/")
    assert predictor.schema.scene == scene
    families = {"kick": "rolling", "contact-force": "modal"}  # of a scene's own ODeform
    assert predictor.model == (families.get(scene, "latent") if model == "odeform" else ALIASES.get(model, model))
    if not predictor.schema.needs_observations:
        few = PointCloud(predictor.rest.points[:20])
        points = predictor.solve(few, until=0.05).vertices(0.05)
        assert points.shape == (20, 3)
        assert np.isfinite(points).all()
