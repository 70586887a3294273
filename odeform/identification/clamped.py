"""Stiffness and damping of a clamped body from markers: from how it hangs, and from how it swings after its release."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares, root_scalar

from odeform.errors import InputError
from odeform.identification.release import Release
from odeform.mechanics.clamped import ClampedBody
from odeform.mechanics.swinging import Loss, Swing, SwingingBody, swinging_body
from odeform.types import Floats, Times

__all__ = [
    "LOSSES",
    "STEP",
    "Beginning",
    "FittedSwing",
    "MarkedBody",
    "fit_swing",
    "frequency_of",
    "marked_body",
    "predict_swing",
    "static_young",
]  # fmt: skip

STEP = 2e-3  # s
LOST = 1e3  # mm, as far as a trial is off that cannot be computed
WIDEST, MOST = 4.0, 30.0  # times the first guess, up to which Young's modulus and the numbers of damping are searched
BRACKET = 1.3  # times the guess, between which the static modulus lies
LOSSES: dict[str, dict[str, float]] = {
    "viscous": {"viscous": 2e-3},
    "relaxing": {"lag": 0.2, "time": 0.02},
}
"""Laws of damping: their numbers, as in `Loss`, and where the search for them begins."""


@dataclass(frozen=True, eq=False)
class MarkedBody:
    """A clamped body in few directions, and what these do to its markers."""

    body: ClampedBody
    swinging: SwingingBody
    rows: Float[np.ndarray, "markers 3 directions"]
    """m by amplitude."""

    def seen(self, swing: Swing, times: Times) -> Float[np.ndarray, "times markers 3"]:
        """(T, P, 3) m: displacements of the markers at times (T,) s of a motion."""
        amplitudes = CubicSpline(swing.times, swing.amplitudes)(times)
        return np.einsum("tr,pir->tpi", amplitudes, self.rows)

    def times_as_stiff(self, young: float) -> SwingingBody:
        """The body with a Young's modulus in Pa."""
        return self.swinging.times_as_stiff(young / self.body.stiffness.young)


def marked_body(body: ClampedBody, release: Release) -> MarkedBody:
    """Makes the directions of a body; its markers move with its nearest points."""
    directions = body.directions()
    rows = body.mesh.rows_at(release.places)
    seen = np.stack([rows @ one for one in directions], axis=-1)
    return MarkedBody(body, swinging_body(body, directions), seen)


def static_young(body: ClampedBody, release: Release) -> float:
    """Young's modulus in Pa with which the markers hang as deep as they were measured, on average.

    `InputError` where none does.
    """
    rows = body.mesh.rows_at(release.places)
    measured = float((release.sag @ release.gravity).mean())
    if measured <= 0.0:
        raise InputError("markers: the tip does not hang below where it was held")

    def missing(log_young: float) -> float:
        hangs = rows @ body.with_young(float(np.exp(log_young))).static()
        return float(np.log((hangs @ release.gravity).mean() / measured))

    # sag is nearly proportional to 1 / E: one guess brackets closely
    guess = np.log(body.stiffness.young)
    guess += missing(guess)
    width = np.log(BRACKET)
    if missing(guess - width) < 0.0 or missing(guess + width) > 0.0:
        raise InputError("no Young's modulus lets the body hang as it was measured; are its masses right?")
    found = root_scalar(missing, bracket=(guess - width, guess + width), method="brentq", xtol=1e-4)
    return float(np.exp(found.root))


@dataclass(frozen=True)
class Beginning:
    """The state in which a body leaves the hand that lets it go: as it hangs under a part of its load, which grows."""

    time: float
    """s since it began to move."""
    part: float
    """Of the load."""
    rate: float
    """1/s, by which that part grows."""


@dataclass(frozen=True, eq=False)
class FittedSwing:
    """What the first part of a motion says, and how it predicts the rest."""

    young: float
    """Pa."""
    loss: Loss
    beginning: Beginning
    until: float
    """s: the end of the part that was fitted."""
    times: Times
    """(T,) s: frames of the release from the beginning on."""
    predicted: Float[np.ndarray, "frames markers 3"]
    """m: displacements there."""
    measured: Float[np.ndarray, "frames markers 3"]
    """m; not a number where a marker is not seen."""

    def rms(self, rest: bool) -> float:
        """m: RMS distance of the markers, in the rest of the motion or in the part that was fitted."""
        chosen = (self.times > self.until) == rest
        away = np.linalg.norm(self.predicted[chosen] - self.measured[chosen], axis=2)
        return float(np.sqrt(np.nanmean(away**2)))


def predict_swing(
    marked: MarkedBody, young: float, loss: Loss, beginning: Beginning, times: Times, step: float = STEP
) -> Float[np.ndarray, "times markers 3"]:
    """(T, P, 3) m: displacements of the markers at times (T,) s, none before the beginning."""
    body = marked.times_as_stiff(young)
    hanging, grows = body.hanging(beginning.part)
    after = times - beginning.time
    swing = body.follow(hanging, beginning.rate * grows, float(after[-1]) + step, step, loss, beginning.time)
    return marked.seen(swing, after)


def fit_swing(marked: MarkedBody, release: Release, law: str, until: float = 0.5, step: float = STEP) -> FittedSwing:
    """Fit Young's modulus, damping and the beginning to the markers up to `until` seconds, by least squares.

    A hand that lets go may lower the body for a while. It can only support it, so that the body is free from where it
    passes the place at which it hangs in the end: the beginning. Nothing else after `until` is looked at.
    `law` is one of `LOSSES`.
    """
    if law not in LOSSES:
        raise InputError(f"damping {law!r}: expected one of {', '.join(LOSSES)}")
    names = LOSSES[law]
    begin = _passing(release)
    times, measured = release.times[begin:], release.displacements[begin:]
    first, start = times <= until, float(times[0])

    def unpacked(values: Floats) -> tuple[float, Loss, Beginning]:
        numbers = {name: float(np.exp(value)) for name, value in zip(names, values[3:], strict=True)}
        return float(np.exp(values[0])), Loss(**numbers), Beginning(start, float(values[1]), float(values[2]))

    def missing(values: Floats) -> Floats:
        try:
            found = predict_swing(marked, *unpacked(values), times[first], step) - measured[first]
        except InputError:  # a trial that no step can follow
            return np.full(int(np.isfinite(measured[first]).sum()), LOST)
        return 1e3 * found[np.isfinite(found)]

    guess = np.array([np.log(marked.body.stiffness.young), 1.0, 20.0, *map(np.log, names.values())])
    room = np.array([np.log(WIDEST), 1.0, 200.0, *[np.log(MOST)] * len(names)])
    fitted = least_squares(
        missing, guess, bounds=(guess - room, guess + room), x_scale=0.1 * room, diff_step=1e-4, xtol=1e-5, ftol=1e-6
    )
    young, loss, beginning = unpacked(fitted.x)
    predicted = predict_swing(marked, young, loss, beginning, times, step)
    return FittedSwing(young, loss, beginning, until, times, predicted, measured)


def _passing(release: Release) -> int:
    """The first frame in which the tip is below where it hangs in the end."""
    depth = np.nanmean(release.displacements @ release.gravity, axis=1)
    below = np.flatnonzero(depth > float((release.sag @ release.gravity).mean()))
    if not len(below):
        raise InputError("markers: the tip never swings below where it hangs; let it go at once")
    return int(below[0])


def frequency_of(times: Times, depth: Floats) -> float:
    """Hz: of a decaying swing around where it ends, (T,) m, from the times at which it passes that place."""
    level = depth - depth[times > times[-1] - 0.2 * (times[-1] - times[0])].mean()
    sign = np.flatnonzero((level[:-1] < 0.0) & (level[1:] >= 0.0))
    size = np.abs(level).max()
    # what is nearly still passes it anywhere
    sign = np.array([at for at in sign if np.abs(level[at : at + 30]).max() > 0.05 * size])
    if len(sign) < 3:
        raise InputError("expected at least three swings to measure a frequency")
    crossings = times[sign] - level[sign] * (times[sign + 1] - times[sign]) / (level[sign + 1] - level[sign])
    return float((len(crossings) - 1) / (crossings[-1] - crossings[0]))
