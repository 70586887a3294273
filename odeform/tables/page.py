"""The tables as a page: ours beside the paper's figures."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from odeform.tables.plan import AHEAD, DROP, FRAMES, IMPACT, INTERVALS, MINUTES, UNTIL
from odeform.tables.runs import Cell, Result

__all__ = ["page"]

METRICS = ("rmse_pooled_mm", "mae_pooled_mm", "mse_pooled_mm2")

# as the paper prints them (Tables II to V): its own data, other balls, another simulator, another clock
UNSEEN = {
    "nODE": (10.344, 6.366, 205.0),
    "RNN": (13.585, 9.035, 260.0),
    "ODeform": (1.279, 0.948, 2.0),
}
UNSEEN_FORCE = {
    "nODE": (6.750, 4.956, 82.71),
    "RNN": (22.670, 16.076, 683.0),
    "PEGNN": (14.220, 9.837, 244.4),
    "ODeform": (6.657, 5.140, 58.43),
}
EXTRAPOLATED = {"nODE": (27.076, 16.208), "RNN": (28.718, 18.169), "ODeform": (3.597, 2.440)}
INTERPOLATED = {
    "RNN": (27.19, 28.37, 39.17),
    "nODE": (24.56, 26.69, 26.59),
    "OccuFlow": (246.31, 244.42, 244.39),
    "ODeform": (3.67, 5.05, 9.47),
}
IDENTIFIED = {"mass": 0.113, "bending": 0.084}

Row = Sequence[str]
Cells = Mapping[Cell, Result]


def page(found: Mapping[str, Any]) -> str:
    """Markdown of all that `tables` found."""
    cells: Mapping[str, Cells] = found["cells"]
    share = f" --share {found['share']:g}" if found["share"] != 1.0 else ""
    commands = dict.fromkeys(
        f"- `{result['command']}` ({result['seconds']:.0f} s)" for of in cells.values() for result in of.values()
    )
    return "\n".join(
        [
            "# Tables II to V",
            "",
            f"Written by `odeform tables{share}`. Within a table every model has the same data, the same split and a",
            "budget of steps, trials of its settings on validation included: steps, unlike minutes, are the same on a",
            f"busy machine. Idle, they took about {MINUTES} minutes of a core when they were set; here, two at a time,",
            f"{_taken(cells)}.",
            "Scores are of the test split, pooled over frames and sequences, in mm and mm². The paper's figures stand",
            "beside; its data are others, so that only orders compare. What is open (–) was not run, or cannot be:",
            "there is no scene of Contact-Force yet.",
            "",
            *_unseen(cells["II"], found["shipped"]),
            *_extrapolated(cells["III"], found["simple"]),
            *_interpolated(cells["IV"], found["simple"]),
            *_identified(found["identified"]),
            "## Commands",
            "",
            *commands,
            "",
        ]
    )


def _taken(cells: Mapping[str, Cells]) -> str:
    """Seconds of a core, least and most, of each model that has a budget."""
    seconds: dict[str, list[float]] = {}
    for of in cells.values():
        for cell, result in of.items():
            if cell.steps is not None:
                seconds.setdefault(cell.model, []).append(result["seconds"])
    return ", ".join(f"`{model}` {min(some):.0f} to {max(some):.0f} s" for model, some in seconds.items())


def _table(head: Row, rows: Iterable[Row]) -> list[str]:
    return ["| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rows)] + [""]


def _number(value: float | None) -> str:
    if value is None:
        return "–"
    return f"{value:.0f}" if value >= 1000.0 else f"{value:.3g}"


def _spread(values: Sequence[float]) -> str:
    """Mean and standard deviation over seeds."""
    if not values:
        return "–"
    return _number(float(np.mean(values))) + (f" ± {np.std(values, ddof=1):.2g}" if len(values) > 1 else "")


def _bold(model: str) -> str:
    return f"**{model}**" if model == "odeform" else model


def _key(window: tuple[int, int]) -> str:
    return f"{window[0]}:{window[1]}"


def _of(cells: Cells, window: tuple[int, int], metric: str, **wanted: object) -> list[float]:
    """That score of the cells that are as wanted, over seeds."""
    found = [r for c, r in cells.items() if all(getattr(c, key) == value for key, value in wanted.items())]
    return [r["scores"][_key(window)][metric] for r in found if _key(window) in r["scores"]]


def _models(cells: Cells, **wanted: object) -> list[str]:
    """Names of the models of the cells that are as wanted, in their order."""
    return list(dict.fromkeys(c.model for c in cells if all(getattr(c, key) == v for key, v in wanted.items())))


def _unseen(cells: Cells, shipped: Mapping[str, Mapping[str, float]]) -> list[str]:
    asked = [(DROP, FRAMES[DROP]), (DROP, IMPACT), ("kick", FRAMES["kick"])]
    head = ["model", "parameters"]
    head += [f"{label}, {unit}" for label in ("drop", "its impact", "kick") for unit in ("RMSE", "MAE", "MSE")]
    rows = []
    for model in _models(cells):
        counts = [r["parameters"] for c, r in cells.items() if c.model == model and c.scene == DROP]
        row = [_bold(model), f"{max(counts):,}" if counts else "–"]
        for scene, window in asked:
            row += [_spread(_of(cells, window, metric, scene=scene, model=model)) for metric in METRICS]
        rows.append(row)
    longer = [_number(shipped[f"{scene} {_key(window)}"][metric]) for scene, window in asked for metric in METRICS]
    rows.append(["odeform, as shipped: trained longer", "", *longer])
    paper = [
        [name, *map(_number, UNSEEN.get(name, (None,) * 3)), *map(_number, UNSEEN_FORCE[name])] for name in UNSEEN_FORCE
    ]
    return [
        "## II. Unseen parameters",
        "",
        f"The drop (`mass-elastic`) whole, and frames {IMPACT[0]} to {IMPACT[1] - 1} with its first two contacts; the",
        "kick whole. ± is the standard deviation over seeds, where there are several; `pod-rbf`, `nearest` draw none.",
        "",
        *_table(head, rows),
        *_table(["paper", "Mass-Elastic, RMSE", "MAE", "MSE", "Contact-Force, RMSE", "MAE", "MSE"], paper),
    ]


def _extrapolated(cells: Cells, simple: Mapping[str, Mapping[str, float]]) -> list[str]:
    windows = [(until, until + AHEAD) for until in UNTIL]
    head = ["model", *(f"{b - AHEAD} to {b - 1}, {unit}" for _, b in windows for unit in ("RMSE", "MAE"))]
    rows = []
    for model in _models(cells):
        row = [_bold(model)]
        for until, window in zip(UNTIL, windows, strict=True):
            row += [_spread(_of(cells, window, metric, model=model, until=until)) for metric in METRICS[:2]]
        rows.append(row)
    for name in ("hold-last", "ballistic"):
        scores = [simple[f"{name} {_key(window)}"] for window in windows]
        rows.append([f"{name}, from the true last frames", *(_number(s[m]) for s in scores for m in METRICS[:2])])
    paper = [[name, *map(_number, values)] for name, values in EXTRAPOLATED.items()]
    return [
        "## III. Extrapolation",
        "",
        f"The {AHEAD} frames after those of the training, at 120 Hz, of drops known to frame {UNTIL[0] - 1}, when the",
        f"stiffer balls have left the floor, and to {UNTIL[1] - 1}, when some have landed again. Models that know no",
        "time beyond their training hold its last frame.",
        "",
        *_table(head, rows),
        *_table(["paper, Mass-Elastic", "RMSE", "MAE"], paper),
    ]


def _interpolated(cells: Cells, simple: Mapping[str, Mapping[str, float]]) -> list[str]:
    head = ["model", "every frame", *(f"every {_nth(k)}" for k in INTERVALS), *(f"{_nth(k)}, MAE" for k in INTERVALS)]
    tables = {}
    for stagger in (True, False):
        rows = []
        for model in _models(cells, stagger=stagger, every=INTERVALS[0]):
            row = [_bold(model), _spread(_of(cells, IMPACT, METRICS[0], model=model, every=1))]
            for metric in METRICS[:2]:
                wanted = {"model": model, "stagger": stagger}
                row += [_spread(_of(cells, IMPACT, metric, every=k, **wanted)) for k in INTERVALS]
            rows.append(row)
        splines = [simple[f"spline {k} staggered" if stagger else f"spline {k}"] for k in INTERVALS]
        errors = [_number(one[metric]) for metric in METRICS[:2] for one in splines]
        tables[stagger] = _table(head, [*rows, ["cubic spline through the true kept frames", "0", *errors]])
    paper = [[name, *map(_number, values)] for name, values in INTERPOLATED.items()]
    return [
        "## IV. Interpolation",
        "",
        f"Drops, frames {IMPACT[0]} to {IMPACT[1] - 1}, all of them, by models taught by every 3rd, 5th or 8th frame;",
        "RMSE, then MAE. Each sequence shows its own frames (`--stagger`: the i-th keeps i, i + k, i + 2 k, ...):",
        "",
        *tables[True],
        "All sequences show the same frames. A contact lasts a few, and none tells what is between those that are",
        "shown. `occupancy-flow` is given the true kept frames of the very motion at test time, as in the paper, and",
        "the others its parameters:",
        "",
        *tables[False],
        *_table(["paper, RMSE", *(f"every {_nth(k)}" for k in INTERVALS)], paper),
    ]


def _nth(k: int) -> str:
    return f"{k}rd" if k == 3 else f"{k}th"


def _identified(identified: Mapping[str, Any]) -> list[str]:
    rows = [
        [scene, name, f"{one['mae_normalised']:.4f}", _covered(one), f"{result['seconds']:.1f} s",
         _number(IDENTIFIED[name]) if scene == DROP else "–"]
        for scene, result in identified.items()
        for name, one in result["parameters"].items()
    ]  # fmt: skip
    return [
        "## V. Identification",
        "",
        "All parameters of a motion together, by the shipped models; MAE in halves of the trained range",
        "(`odeform identify`). The paper recovers one at a time.",
        "",
        *_table(["scene", "parameter", "MAE", "in 90 % interval", "a sequence", "paper"], rows),
    ]


def _covered(one: Mapping[str, Any]) -> str:
    return "–" if one["coverage_90"] is None else f"{100 * one['coverage_90']:.0f} %"
