"""A small clamped body, and a recording of its markers, for tests."""

import io

import numpy as np

from odeform.geometry.solids.block import block
from odeform.mechanics.clamped import GRAVITY, held_by_face
from odeform.mechanics.quadratic import quadratic_mesh
from odeform.models.clamped import ClampedModel, clamped_checkpoint
from odeform.types import PointCloud

__all__ = ["HELD", "PLACES", "clamped_bar", "recording"]

PLACES = {
    "tip": {"Tip 1": (0.015, 0.1, 0.034), "Tip 2": (0.036, 0.1, 0.024), "Tip 3": (-0.006, 0.1, 0.006)},
    "base": {"Base 1": (0.04, 0.006, 0.0), "Base 2": (-0.01, 0.006, 0.0275), "Base 3": (-0.01, 0.006, -0.001)},
}
HELD = 30  # frames before it is let go
RATE, AFTER = 100.0, 260


def clamped_bar(poisson: float = 0.49) -> ClampedModel:
    """A bar along y that is held at its low end."""
    points, elements = block(np.zeros(3), np.array([0.03, 0.1, 0.03]), (1, 4, 1))
    held = held_by_face(quadratic_mesh(points, elements), 1, low=True)
    edge = np.array([[0.0, 0.1, 0.03], [0.03, 0.1, 0.03]])
    gravity = np.array([0.0, 0.0, -GRAVITY])
    return ClampedModel(clamped_checkpoint(points, elements, held, (poisson, 1070.0), gravity, edge, PLACES, 1.0))


def recording(model: ClampedModel, parameters: dict[str, float], lost: tuple[int, ...] = ()) -> bytes:
    """An .npz file of the markers of the bar, in other axes; the first one is not seen in the frames `lost`."""
    places = np.array([*PLACES["tip"].values(), *PLACES["base"].values()])
    swing = model.solve(PointCloud(places[:3].astype(np.float32)), parameters)
    points = np.tile(places, (HELD + AFTER, 1, 1))
    points[HELD:, :3] = swing.vertices(np.arange(AFTER) / RATE)
    points[list(lost), 0] = np.nan
    labels = [*PLACES["tip"], *PLACES["base"]]
    turned = points[..., [1, 2, 0]] + 0.3
    np.savez(file := io.BytesIO(), times=np.arange(len(points)) / RATE, positions=turned, labels=labels)
    return file.getvalue()
