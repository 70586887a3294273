"""The timeline under the scene: buttons, and a track with the trained window, what acts, and the deformation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from odeform.schema import Window
from odeform_viz.view import Curves, shown_until

__all__ = ["Marks", "moment_css", "playing_css", "timeline_html"]

WIDTH, HEIGHT = 1000, 32  # units of the drawing
ROOM = 0.2 * WIDTH  # of two labels
ICONS = {
    "0": "M6 5h2v14H6zM20 5v14L9 12z",
    "J": "M17 5v14L6 12zM18 5h2v14h-2z",
    "L": "M7 5v14l11-7zM4 5h2v14H4z",
    "play": "M7 4v16l13-8z",
    "pause": "M6 5h4v14H6zM14 5h4v14h-4z",
}


@dataclass(frozen=True, eq=False)
class Marks:
    """What a track shows of a motion: its `curves`, when something acts (from, to) in s, and the end of the truth."""

    curves: Curves
    acting: Sequence[tuple[float, float]] = ()
    truth_end: float | None = None


def timeline_html(
    window: Window, slider: str, marks: Marks | None, speed: str, loop: bool, known: str = "trained"
) -> str:
    """Buttons that press hot keys, and the track, which moves the slider of that id; `known` says what ends with the
    window."""
    both = "".join(f'<span class="odeform-to-{name}">{_icon(name)}</span>' for name in ("play", "pause"))
    play = _button("K", both, "play or pause")
    steps = (
        _button("0", _icon("0"), "go to the start", "wide")
        + _button("J", _icon("J"), "previous frame", "fine")
        + play
        + _button("L", _icon("L"), "next frame", "fine")
        + _button("P", "peak", "go to the largest deformation", "fine")
    )
    pace = _button("S", speed if "/" not in speed else f"{speed} speed", "another speed of playing", "wide")
    again = _button("R", "loop" if loop else "once", "play again and again, or once", "fine")
    return (
        f'<div class="odeform-buttons">{steps}</div><div class="odeform-moment"></div>'
        f"{_track(window, slider, marks, known)}"
        f'<div class="odeform-buttons">{pace}{again}</div>'
    )


def moment_css(window: Window, time: float) -> str:
    """A style that shows `time` in seconds; sent instead of the timeline."""
    share = (time - window.start) / (shown_until(window) - window.start)
    return (
        f"<style>.odeform-track i{{left:{100.0 * min(max(share, 0.0), 1.0):.2f}%}}"
        f'.odeform-moment::after{{content:"{time:.3f} s"}}</style>'
    )


def playing_css(playing: bool) -> str:
    """A style that shows what the button of playing does next; sent instead of the timeline."""
    return f"<style>.odeform-to-{'play' if playing else 'pause'}{{display:none}}</style>"


def _button(key: str, content: str, title: str, narrow: str = "") -> str:
    """What is `narrow` = "wide" is left out on phones, and what is "fine" in narrow windows too."""
    kind = f' class="odeform-{narrow}"' if narrow else ""
    return f'<a role="link" data-hotkey="{key}" title="{title} ({key})"{kind}>{content}</a>'


def _icon(name: str) -> str:
    return f'<svg viewBox="0 0 24 24"><path d="{ICONS[name]}"/></svg>'


def _track(window: Window, slider: str, marks: Marks | None, known: str) -> str:
    end = shown_until(window)

    def at(time: float) -> float:
        return WIDTH * (time - window.start) / (end - window.start)

    parts = [
        f'<rect class="ground" width="{WIDTH}" height="{HEIGHT}"/>',
        f'<rect class="beyond" x="{at(window.stop):.1f}" width="{WIDTH - at(window.stop):.1f}" height="{HEIGHT}"/>',
    ]
    labels = [(0.0, f"{window.start:g} s", ""), (at(window.stop), f"{known} until {window.stop:g} s", "until")]
    last = f"{end:.3g} s"
    if marks is not None:
        parts.append(f'<path class="shape" d="{_profile(marks.curves)}"/>')
        parts += [
            f'<rect class="acting" x="{at(a):.1f}" width="{max(at(b) - at(a), 3.0):.1f}" y="{HEIGHT - 4}" height="4"/>'
            for a, b in marks.acting
        ]
        if marks.truth_end is not None and marks.truth_end < end - 1e-6:
            x = at(marks.truth_end)
            parts.append(f'<path class="mark" d="M{x:.1f} 0V{HEIGHT}"/>')
            if x > WIDTH - ROOM:  # both would stand in one place
                last = f"truth until {marks.truth_end:.3g} s"
            elif abs(x - at(window.stop)) > ROOM:
                labels.append((x, f"truth until {marks.truth_end:.3g} s", "truth"))
    labels.append((WIDTH, last, "last"))
    texts = "".join(
        f'<span class="{kind}" style="left:{100.0 * x / WIDTH:.1f}%">{text}</span>' for x, text, kind in labels
    )
    return (
        f'<div class="odeform-track" data-time-slider="{slider}" data-start="{window.start:g}" data-stop="{end:g}" '
        f'title="grey: the deformation; orange, below: a force acts; orange, above: after what was {known}">'
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" preserveAspectRatio="none">{"".join(parts)}</svg>{texts}<i></i></div>'
    )


def _profile(curves: Curves) -> str:
    """The area under the deformation, as high as the track."""
    times, values = curves.times, np.nan_to_num(curves.deformation)
    x = WIDTH * (times - times[0]) / (times[-1] - times[0])
    y = HEIGHT * (1.0 - 0.92 * values / max(float(values.max()), 1e-9))
    middle = "".join(f"L{a:.1f} {b:.1f}" for a, b in zip(x.tolist(), y.tolist(), strict=True))
    return f"M0 {HEIGHT}{middle}L{WIDTH} {HEIGHT}Z"
