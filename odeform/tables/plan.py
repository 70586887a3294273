"""The paper's tables on the scenes at hand: which model is trained on what, how long, and scored on which frames."""

from collections.abc import Iterable
from dataclasses import replace

from odeform.tables.cells import Cell

__all__ = ["AHEAD", "DROP", "FRAMES", "IMPACT", "INTERVALS", "MINUTES", "UNTIL", "plan"]

MINUTES = {"II": 5.0, "III": 3.0, "IV": 3.0}
"""Of processor time for each training of a table. `pod-rbf` and `nearest` take seconds."""
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
RIVALS = ("pod-rbf", "nearest", "direct", "node", "rnn")


def plan(share: float = 1.0) -> dict[str, list[Cell]]:
    """The cells of each table, with this share of its minutes."""
    minutes = {table: share * of for table, of in MINUTES.items()}
    return {
        "II": [cell for scene in FRAMES for cell in _unseen(scene, minutes["II"])],
        "III": list(_extrapolation(minutes["III"])),
        "IV": list(_interpolation(minutes["IV"])),
    }


def _unseen(scene: str, minutes: float) -> Iterable[Cell]:
    """Table II: unseen parameters."""
    scored = (FRAMES[scene], IMPACT) if scene == DROP else (FRAMES[scene],)
    yield from (Cell("odeform", scene, scored, minutes, seed) for seed in SEEDS)
    yield from (Cell(model, scene, scored, minutes) for model in (*RIVALS, "odeform-per-point"))


def _extrapolation(minutes: float) -> Iterable[Cell]:
    """Table III: the frames after those of the training."""
    for until in UNTIL:
        for model in ("odeform", *RIVALS):
            yield Cell(model, DROP, ((until, until + AHEAD),), minutes, until=until)


def _interpolation(minutes: float) -> Iterable[Cell]:
    """Table IV: all frames of the impact, from all and from every k-th; interleaved, or of all sequences the same.

    Only the observer's own clock can give frames at test time, as `occupancy-flow` needs them.
    """
    for model in ("odeform", *RIVALS):
        cell = Cell(model, DROP, (IMPACT,), minutes)
        yield cell
        yield from (replace(cell, every=every, stagger=True) for every in INTERVALS)
    for model in ("odeform", "pod-rbf", "occupancy-flow"):
        yield from (Cell(model, DROP, (IMPACT,), minutes, every=every) for every in INTERVALS)
