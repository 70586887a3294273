import numpy as np
import pytest

from odeform.models.base import Predictor
from odeform_figures.speed.ablations import with_modes

TIMES = np.array([0.0, 0.03, 0.4])


def test_all_modes_give_the_motion_and_none_its_rigid_part(predictors: dict[str, Predictor]) -> None:
    motion = predictors["odeform"].solve()
    modes = len(motion.evaluated.values)
    assert np.array_equal(with_modes(motion, modes).vertices(TIMES), motion.vertices(TIMES))
    pose, rest = motion.pose(TIMES), np.asarray(motion.geometry.points, dtype=float)
    rigid = rest @ pose[:, :3, :3].swapaxes(1, 2) + pose[:, None, :3, 3]
    assert np.abs(with_modes(motion, 0).vertices(TIMES) - rigid).max() < 1e-6


@pytest.mark.parametrize("kept", [0, 1, 3])
def test_removed_modes_are_what_is_missing(predictors: dict[str, Predictor], kept: int) -> None:
    motion = predictors["odeform"].solve()
    y = motion.trajectory.reduced(TIMES)
    values = motion.evaluated.values[kept:].reshape(-1, len(motion.evaluated.points), 3)
    left_out = np.einsum("tk,kni->tni", y[:, 6 + kept :], values)
    turned = left_out @ motion.pose(TIMES)[:, :3, :3].swapaxes(1, 2)  # the default azimuth is along x
    missing = motion.vertices(TIMES) - with_modes(motion, kept).vertices(TIMES)
    assert np.abs(missing).max() > 1e-5
    assert np.abs(missing - turned).max() < 1e-6
