"""A measured release: markers on a body that is clamped, held straight, let go, and comes to rest."""

import io
import re
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from odeform.errors import InputError
from odeform.formats.motion_capture import read_c3d
from odeform.geometry.rigid import best_rigid
from odeform.types import Floats, Frames, MotionSequence, Points, Times, Vector

__all__ = ["MarkerLayout", "Markers", "Release", "markers_in", "read_markers", "recorded_release", "released"]

MOVES = 0.1  # of the sag: what has moved that far has been let go
BEGINS = 0.03  # of the sag, from which on it counts as begun
HELD = 0.2  # s before the release, over which markers are averaged
SETTLED = 0.5  # s at the end, over which they are, too
FAR = 0.02  # m: markers that lie farther from their places than this are other markers, or in other axes


@dataclass(frozen=True, eq=False)
class Markers:
    """Paths of markers, not a number where one is not seen."""

    times: Times
    """(T,) s."""
    points: Frames
    """(T, P, 3) m in the axes of the capture."""
    labels: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class MarkerLayout:
    """Where markers are: names and places in m, on the body without stress and on what holds it."""

    tip: Mapping[str, tuple[float, float, float]]
    base: Mapping[str, tuple[float, float, float]]


@dataclass(frozen=True, eq=False)
class Release:
    """What was measured, in the axes of the body. Time 0 is the last frame before it moves."""

    times: Times
    """(T,) s, from time 0 on."""
    displacements: Float[np.ndarray, "frames markers 3"]
    """m, of the markers of the tip since they were held; not a number where one is not seen."""
    places: Points
    """(P, 3) m: where these were held."""
    gravity: Vector
    """(3,) of unit length."""
    misfit: float
    """m: RMS by which the markers that were held lie beside their places in the layout."""
    base: float
    """m: how far the base moved, from when the body was held to when it hangs; the most of its markers."""
    noise: float
    """m: standard deviation of a coordinate of the tip at rest."""

    @property
    def sag(self) -> Float[np.ndarray, "markers 3"]:
        """m: where the markers hang in the end."""
        with np.errstate(invalid="ignore"):
            return np.nanmean(self.displacements[self.times > self.times[-1] - SETTLED], axis=0)


def read_markers(path: Path | str) -> Markers:
    """The markers in a `.c3d` file, or an `.npz` file with `times` (T,) s, `positions` (T, P, 3) m and `labels` (P,).

    Raises:
        InputError: Another file, or one that is damaged.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    return markers_in(path.read_bytes(), str(path))


def markers_in(data: bytes, path: str) -> Markers:
    """The markers in the bytes of a file, as `read_markers` has them; `path` is its name. `InputError` as there."""
    if path.lower().endswith(".c3d"):
        capture = read_c3d(data, path, gaps=True)
        return Markers(capture.times, capture.points, capture.labels)
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            times, points, labels = (arrays[name] for name in ("times", "positions", "labels"))
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: expected a .c3d, or an .npz with times, positions and labels: {error}") from None
    points = np.asarray(points, dtype=float)
    if points.shape != (len(times), len(labels), 3):
        raise InputError(f"{path}: expected positions ({len(times)}, {len(labels)}, 3), got {points.shape}")
    return Markers(np.asarray(times, dtype=float), points, tuple(map(str, labels)))


def released(markers: Markers, layout: MarkerLayout) -> Release:
    """Find when a body was let go, and turn the axes of the capture into its own by all markers while it is held.

    Gravity is along the axis of the capture that is nearest to the way in which the tip moves. Markers that the layout
    does not know are ignored.

    Raises:
        InputError: Markers of the layout are missing, it is never let go, or does not come to rest.
    """
    known = {_plain(label): index for index, label in enumerate(markers.labels)}
    names = [*layout.tip, *layout.base]
    if missing := [name for name in names if _plain(name) not in known]:
        raise InputError(f"markers: {', '.join(missing)} missing; there are {', '.join(markers.labels) or 'none'}")
    points = markers.points[:, [known[_plain(name)] for name in names]]
    tip = points[:, : len(layout.tip)]
    begin = _release_frame(markers.times, tip)
    times = markers.times - markers.times[begin]
    held = np.nanmean(points[(times >= -HELD) & (times <= 0.0)], axis=0)
    settled = np.nanmean(points[times > times[-1] - SETTLED], axis=0)
    if not np.isfinite([held, settled]).all():
        raise InputError("markers: each has to be seen both before the release and at the end")
    nominal = np.array([*layout.tip.values(), *layout.base.values()])
    even = np.full(len(nominal), 1.0 / len(nominal))
    turn, shift = best_rigid(held, nominal, even)
    centre = even @ held
    misfit = float(np.sqrt((((held - centre) @ turn.T + centre + shift - nominal) ** 2).sum(axis=1).mean()))
    if misfit > FAR:
        raise InputError(f"markers: they lie {1e3 * misfit:.0f} mm beside their places in the layout; mixed up labels?")
    count = len(layout.tip)
    places = (held[:count] - centre) @ turn.T + centre + shift
    fall = (settled - held)[:count].mean(axis=0)
    axis = int(np.abs(fall).argmax())
    gravity = turn @ (np.sign(fall[axis]) * np.eye(3)[axis])
    after = times >= -1e-9
    still = tip[times > times[-1] - SETTLED]
    return Release(
        times[after],
        (tip[after] - held[:count]) @ turn.T,
        places,
        gravity,
        misfit,
        float(np.linalg.norm((settled - held)[count:], axis=1).max()),
        float(np.nanmean(np.nanstd(still, axis=0))),
    )


def recorded_release(release: Release, name: str) -> MotionSequence:
    """The markers of the tip as a motion to compare with: they are the vertices of a plate, and what is not seen lies
    on a line between what is. `InputError` for fewer than three markers."""
    count = len(release.places)
    if count < 3:
        raise InputError(f"{name}: expected at least three markers at the tip, got {count}")
    paths = release.places + release.displacements
    for path in paths.reshape(len(paths), -1).T:
        seen = np.isfinite(path)
        path[:] = np.interp(release.times, release.times[seen], path[seen])
    fan = np.array([[0, at, at + 1] for at in range(1, count - 1)])
    times = np.linspace(0.0, float(release.times[-1] - release.times[0]), len(release.times))
    even = np.full(count, 1.0 / count)
    return MotionSequence(times, paths.astype(np.float32), np.concatenate([fan, fan[:, ::-1]]), even, {}, name)


def _release_frame(times: Times, tip: Floats) -> int:
    """The last frame before the tip begins to move for good."""
    middle = np.nanmean(tip, axis=1)
    seen = np.isfinite(middle).all(axis=1)
    first, last = middle[seen][0], np.nanmean(middle[times > times[-1] - SETTLED], axis=0)
    sag = float(np.linalg.norm(last - first))
    if sag < 1e-4:
        raise InputError("markers: the tip never moves; expected a body that is held straight and let go")
    away = np.linalg.norm(middle - first, axis=1)
    far = np.flatnonzero(seen & (away > MOVES * sag))
    before = np.flatnonzero(seen[: far[0]] & (away[: far[0]] < BEGINS * sag))
    if not len(before) or times[-1] - times[far[0]] < 2.0 * SETTLED:
        raise InputError("markers: expected some frames before the release, and a second after it")
    return int(before[-1])


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())
