"""The paper's tables on the scenes at hand: which model is trained on what, how long, and scored on which frames.

Budgets are steps, so that a busy machine, or another one, makes the same models.
"""

from collections.abc import Iterable
from dataclasses import replace

from odeform.tables.runs import Cell

__all__ = ["AHEAD", "DROP", "FRAMES", "IMPACT", "INTERVALS", "MINUTES", "UNTIL", "plan"]

DROP = "mass-elastic"
FRAMES = {DROP: (0, 151), "kick": (0, 121)}
"""Of each scene, all of them."""
IMPACT = (30, 89)
"""Frames of the drop from just before the first contact to after the second; every 3rd, 5th and 8th ends beyond."""
SEEDS = (0, 1, 2)
"""Of ours; the best rival, `pod-rbf`, draws nothing."""
UNTIL, AHEAD = (40, 70), 10
"""Frames that are known, to the end of the first contact and into the second, and those to be told, of the drop."""
INTERVALS = (3, 5, 8)
SOLVED = ("pod-rbf", "nearest")
RIVALS = (*SOLVED, "direct", "node", "rnn")
MINUTES = 4
STEPS = {"direct": 2000, "node": 900, "rnn": 1400, "occupancy-flow": 590, "odeform-per-point": 460}
OURS = {FRAMES[DROP][1]: 330, FRAMES["kick"][1]: 280, UNTIL[0]: 900, UNTIL[1]: 690}
"""Steps, by the number of frames for ours, that took about `MINUTES` of one core of an AMD EPYC 7003, trials and
random features included. Networks of points take as long for a step whatever the frames."""
THINNED = {3: 240, 5: 180, 8: 120}
"""The same where all of the drop, but every 3rd, 5th or 8th frame, is known: a step then takes more sequences."""


def plan(share: float = 1.0) -> dict[str, list[Cell]]:
    """The cells of each table, with this share of their steps."""
    tables = {
        "II": [cell for scene in FRAMES for cell in _unseen(scene)],
        "III": list(_extrapolation()),
        "IV": list(_interpolation()),
    }
    return {
        table: [
            cell if cell.steps is None else replace(cell, steps=max(round(share * cell.steps), 1)) for cell in cells
        ]
        for table, cells in tables.items()
    }


def _steps(model: str, frames: int, every: int = 1) -> int | None:
    if model in SOLVED:
        return None
    if model != "odeform":
        return STEPS[model]
    return OURS[frames] if every == 1 else THINNED[every]


def _whole(model: str, scene: str, seed: int = 0) -> Cell:
    """Taught by all frames of all sequences."""
    scored = (FRAMES[scene], IMPACT) if scene == DROP else (FRAMES[scene],)
    return Cell(model, scene, scored, _steps(model, FRAMES[scene][1]), seed)


def _unseen(scene: str) -> Iterable[Cell]:
    """Table II: unseen parameters."""
    yield from (_whole("odeform", scene, seed) for seed in SEEDS)
    yield from (_whole(model, scene) for model in (*RIVALS, "odeform-per-point"))


def _extrapolation() -> Iterable[Cell]:
    """Table III: the frames after those of the training."""
    for until in UNTIL:
        for model in ("odeform", *RIVALS):
            yield Cell(model, DROP, ((until, until + AHEAD),), _steps(model, until), until=until)


def _interpolation() -> Iterable[Cell]:
    """Table IV: all frames of the impact, from all and from every k-th; interleaved, or of all sequences the same.

    Only the observer's own clock can give frames at test time, as `occupancy-flow` needs them.
    """

    def thinned(model: str, stagger: bool) -> Iterable[Cell]:
        for every in INTERVALS:
            yield Cell(model, DROP, (IMPACT,), _steps(model, FRAMES[DROP][1], every), every=every, stagger=stagger)

    for model in ("odeform", *RIVALS):
        yield _whole(model, DROP)
        yield from thinned(model, stagger=True)
    for model in ("odeform", "pod-rbf", "occupancy-flow"):
        yield from thinned(model, stagger=False)
