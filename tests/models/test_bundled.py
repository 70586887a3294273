"""Every checkpoint that comes with the package opens, and predicts finite points."""

import numpy as np
import pytest

from odeform.checkpoint import bundled_checkpoints
from odeform.models.registry import load
from odeform.types import PointCloud


@pytest.mark.parametrize("name", bundled_checkpoints())
def test_it_opens_and_predicts(name: str):
    predictor = load(name)
    # a scene's own ODeform may be of a kind of its own
    kind = predictor.model.removesuffix("-mechanical").removesuffix("-rolling")
    assert name in {f"{predictor.schema.scene}/{one}" for one in (kind, predictor.model)}
    if not predictor.schema.needs_observations:
        few = PointCloud(predictor.rest.points[:20])
        points = predictor.solve(few, until=0.05).vertices(0.05)
        assert points.shape == (20, 3)
        assert np.isfinite(points).all()
