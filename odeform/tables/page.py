"""The tables as a Markdown page, beside the paper's figures."""

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from odeform.tables.paper import EXTRAPOLATED, IDENTIFIED, INTERPOLATED, UNSEEN, UNSEEN_FORCE
from odeform.tables.plan import AHEAD, DROP, FRAMES, IMPACT, INTERVALS, MINUTES, UNTIL
from odeform.tables.runs import Result, Run

__all__ = ["page"]

METRICS = ("rmse_pooled_mm", "mae_pooled_mm", "mse_pooled_mm2")

Row = Sequence[str]
Runs = Mapping[Run, Result]


def page(found: Mapping[str, Any]) -> str:
    """Markdown of the results that `odeform.tables.tables` collects."""
    runs: Mapping[str, Runs] = found["runs"]
    share = f" --share {found['share']:g}" if found["share"] != 1.0 else ""
    commands = dict.fromkeys(
        f"- `{result['command']}` ({result['seconds']:.0f} s)" for of in runs.values() for result in of.values()
    )
    return "\n".join(
        [
            "# Tables II to V",
            "",
            *_paragraph(
                f"Written by `odeform tables{share}`.",
                "Within a table every model is trained on the same data and split, with a fixed budget of steps that",
                "includes trials of its settings on the validation split.",
                "Unlike minutes, steps do not depend on the load of the machine.",
                f"On an idle core each budget took about {MINUTES} minutes when it was set.",
                f"Here, with two runs at a time: {_taken(runs)}.",
            ),
            "",
            *_paragraph(
                "Scores are on the test split, pooled over frames and sequences, in mm and mm².",
                "The paper's figures are shown below each table; its data differ, so only the ranking can be compared.",
                "A dash (–) was not run, or cannot be run: there is no Contact-Force scene yet.",
            ),
            "",
            *_unseen(runs["II"], found["shipped"]),
            *_extrapolated(runs["III"], found["simple"]),
            *_interpolated(runs["IV"], found["simple"]),
            *_identified(found["identified"]),
            "## Commands",
            "",
            *commands,
            "",
        ]
    )


def _taken(runs: Mapping[str, Runs]) -> str:
    """Shortest and longest training time of each model that has a budget of steps."""
    seconds: dict[str, list[float]] = {}
    for of in runs.values():
        for run, result in of.items():
            if run.steps is not None:
                seconds.setdefault(run.model, []).append(result["seconds"])
    return ", ".join(f"`{model}` {min(some):.0f} to {max(some):.0f} s" for model, some in seconds.items())


def _paragraph(*parts: str) -> list[str]:
    return textwrap.wrap(" ".join(parts), 118, break_long_words=False, break_on_hyphens=False)


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


def _of(runs: Runs, window: tuple[int, int], metric: str, **attributes: object) -> list[float]:
    """A score of the runs with these attributes, one per seed."""
    found = [r for run, r in runs.items() if all(getattr(run, key) == value for key, value in attributes.items())]
    return [r["scores"][_key(window)][metric] for r in found if _key(window) in r["scores"]]


def _models(runs: Runs, **attributes: object) -> list[str]:
    """Names of the models of the runs with these attributes, in order."""
    return list(
        dict.fromkeys(run.model for run in runs if all(getattr(run, key) == v for key, v in attributes.items()))
    )


def _unseen(runs: Runs, shipped: Mapping[str, Mapping[str, float]]) -> list[str]:
    asked = [(DROP, FRAMES[DROP]), (DROP, IMPACT), ("kick", FRAMES["kick"])]
    head = ["model", "parameters"]
    head += [f"{label}, {unit}" for label in ("drop", "its impact", "kick") for unit in ("RMSE", "MAE", "MSE")]
    rows = []
    for model in _models(runs):
        counts = [r["parameters"] for run, r in runs.items() if run.model == model and run.scene == DROP]
        row = [_bold(model), f"{max(counts):,}" if counts else "–"]
        for scene, window in asked:
            row += [_spread(_of(runs, window, metric, scene=scene, model=model)) for metric in METRICS]
        rows.append(row)
    longer = [_number(shipped[f"{scene} {_key(window)}"][metric]) for scene, window in asked for metric in METRICS]
    rows.append(["odeform, bundled checkpoint: trained longer", "", *longer])
    paper = [
        [name, *map(_number, UNSEEN.get(name, (None,) * 3)), *map(_number, UNSEEN_FORCE[name])] for name in UNSEEN_FORCE
    ]
    return [
        "## II. Unseen parameters",
        "",
        *_paragraph(
            f"All frames of the drop (`mass-elastic`), its frames {IMPACT[0]} to {IMPACT[1] - 1} with the first two",
            "contacts, and all frames of the kick.",
            "± is the standard deviation over seeds; `pod-rbf` and `nearest` are deterministic.",
        ),
        "",
        *_table(head, rows),
        *_table(["paper", "Mass-Elastic, RMSE", "MAE", "MSE", "Contact-Force, RMSE", "MAE", "MSE"], paper),
    ]


def _extrapolated(runs: Runs, simple: Mapping[str, Mapping[str, float]]) -> list[str]:
    windows = [(until, until + AHEAD) for until in UNTIL]
    head = ["model", *(f"{b - AHEAD} to {b - 1}, {unit}" for _, b in windows for unit in ("RMSE", "MAE"))]
    rows = []
    for model in _models(runs):
        row = [_bold(model)]
        for until, window in zip(UNTIL, windows, strict=True):
            row += [_spread(_of(runs, window, metric, model=model, until=until)) for metric in METRICS[:2]]
        rows.append(row)
    for name in ("hold-last", "ballistic"):
        scores = [simple[f"{name} {_key(window)}"] for window in windows]
        rows.append([f"{name}, given the true last frames", *(_number(s[m]) for s in scores for m in METRICS[:2])])
    paper = [[name, *map(_number, values)] for name, values in EXTRAPOLATED.items()]
    return [
        "## III. Extrapolation",
        "",
        *_paragraph(
            f"The {AHEAD} frames after the trained ones, at 120 Hz.",
            f"Drops are trained to frame {UNTIL[0] - 1}, when the stiffer balls have left the floor, or to frame",
            f"{UNTIL[1] - 1}, when some have landed again.",
            "Models that cannot extrapolate in time hold their last trained frame.",
        ),
        "",
        *_table(head, rows),
        *_table(["paper, Mass-Elastic", "RMSE", "MAE"], paper),
    ]


def _interpolated(runs: Runs, simple: Mapping[str, Mapping[str, float]]) -> list[str]:
    head = ["model", "every frame", *(f"every {_nth(k)}" for k in INTERVALS), *(f"{_nth(k)}, MAE" for k in INTERVALS)]
    tables = {}
    for stagger in (True, False):
        rows = []
        for model in _models(runs, stagger=stagger, every=INTERVALS[0]):
            row = [_bold(model), _spread(_of(runs, IMPACT, METRICS[0], model=model, every=1))]
            for metric in METRICS[:2]:
                attributes = {"model": model, "stagger": stagger}
                row += [_spread(_of(runs, IMPACT, metric, every=k, **attributes)) for k in INTERVALS]
            rows.append(row)
        splines = [simple[f"spline {k} staggered" if stagger else f"spline {k}"] for k in INTERVALS]
        errors = [_number(one[metric]) for metric in METRICS[:2] for one in splines]
        tables[stagger] = _table(head, [*rows, ["cubic spline through the true trained frames", "0", *errors]])
    paper = [[name, *map(_number, values)] for name, values in INTERPOLATED.items()]
    return [
        "## IV. Interpolation",
        "",
        *_paragraph(
            f"All frames {IMPACT[0]} to {IMPACT[1] - 1} of drops, by models trained on every 3rd, 5th or 8th frame;",
            "RMSE, then MAE.",
            "Trained frames are staggered between sequences (`--stagger`: the i-th keeps i, i + k, i + 2 k, ...):",
        ),
        "",
        *tables[True],
        *_paragraph(
            "Trained frames are the same in all sequences.",
            "A contact lasts a few frames, so no sequence shows what happens between the trained ones.",
            "At test time `occupancy-flow` is given the true trained frames of the same motion, as in the paper, and",
            "the other models its parameters:",
        ),
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
        *_paragraph(
            "All parameters of a motion together, by the bundled checkpoints; MAE in halves of the trained range",
            "(`odeform identify`). The paper recovers one parameter at a time.",
        ),
        "",
        *_table(["scene", "parameter", "MAE", "in 90 % interval", "time per sequence", "paper"], rows),
    ]


def _covered(one: Mapping[str, Any]) -> str:
    return "–" if one["coverage_90"] is None else f"{100 * one['coverage_90']:.0f} %"
