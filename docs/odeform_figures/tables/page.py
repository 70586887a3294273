"""The tables as a Markdown page, beside the paper's figures."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from odeform_figures.tables.cells import Runs, key_of, models, number, paragraph, scored_rows, scores_of, table
from odeform_figures.tables.paper import (
    EXTRAPOLATED,
    EXTRAPOLATED_FORCE,
    IDENTIFIED,
    INTERPOLATED,
    UNSEEN,
    UNSEEN_FORCE,
    UNSEEN_OBJECTS,
)
from odeform_figures.tables.plan import AHEAD, DROP, FINAL, FORCE, FRAMES, IMPACT, INTERVALS, MINUTES, PUSH, UNTIL
from odeform_figures.tables.runs import ALONE
from odeform_figures.tables.studies import ablations, learning_curve

__all__ = ["page"]

METRICS = ("rmse_pooled_mm", "mae_pooled_mm", "mse_pooled_mm2")
SHAPE = "deformation_relative"
SIMPLE = {
    "continued": "the true frames of the window, continued",
    "hold-last": "the true last frame, held",
    "ballistic": "ballistic flight from the true last frames",
}
"""Rows of the table of extrapolation that know the true window."""
PAIR = (METRICS[0], SHAPE)


def page(found: Mapping[str, Any]) -> str:
    """Returns Markdown of the results that `odeform_figures.tables.tables` collects."""
    runs: Mapping[str, Runs] = found["runs"]
    fraction = f" --fraction {found['share']:g}" if found["share"] != 1.0 else ""
    commands = dict.fromkeys(
        f"- `{result['command']}` ({result['seconds']:.0f} s)" for of in runs.values() for result in of.values()
    )
    return "\n".join(
        [
            "# Tables I to V, ablations and learning curve",
            "",
            *paragraph(
                f"Written by `odeform tables{fraction}`.",
                "Within a table every model is trained on the same data and split, with a fixed budget of steps that",
                "includes trials of its settings on the validation split.",
                "Unlike minutes, steps do not depend on the load of the machine.",
                f"On an idle core each budget took about {MINUTES[DROP]} minutes when it was set, and",
                f"{MINUTES['kick']} on the kick; that of `odeform-rolling` on the drop takes twice as long.",
                f"Here, with two runs at a time: {_taken(runs)}.",
            ),
            "",
            *paragraph(
                "Scores are on the test split, pooled over frames and sequences, in mm and mm².",
                "The paper's figures are shown below each table; its data differ, so only the ranking can be compared.",
                "Scores of pushed objects (`contact-force`) are means of seven objects.",
                "A dash (–) was not run, or cannot be run.",
            ),
            "",
            *_objects(runs["I"]),
            *_unseen(runs["II"], found["shipped"]),
            *_extrapolated(runs["III"], found["simple"]),
            *_interpolated(runs["IV"], found["simple"]),
            *_identified(found["identified"]),
            *ablations(runs["ablations"]),
            *learning_curve(runs["learning curve"]),
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


def _objects(runs: Runs) -> list[str]:
    key = key_of(FRAMES[FORCE])
    each = {run.model: r["scores"][key].get("objects") for run, r in runs.items() if not run.objects}
    each = {model: objects for model, objects in each.items() if objects}
    alone = {run.objects[0]: r["scores"][key]["objects"][run.objects[0]] for run, r in runs.items() if run.objects}
    if not each:
        return []
    others = [model for model in each if model != "odeform"]
    head = ["object", "odeform, RMSE", "MAE", "MSE", "deformation"]
    head += [f"{model}, {unit}" for model in others for unit in ("RMSE", "deformation")]
    asked = [("odeform", metric) for metric in (*METRICS, SHAPE)] + [(m, metric) for m in others for metric in PAIR]
    values = {name: [each[model][name][metric] for model, metric in asked] for name in UNSEEN_OBJECTS}
    if alone.keys() == values.keys():
        head += [f"odeform, trained on that object alone, {unit}" for unit in ("RMSE", "deformation")]
        asked += [("", metric) for metric in PAIR]
        values = {name: [*row, *(alone[name][metric] for metric in PAIR)] for name, row in values.items()}
    values["mean"] = np.mean(list(values.values()), axis=0).tolist()
    rows = [
        [name, *(_score(v, metric) for v, (_, metric) in zip(row, asked, strict=True))] for name, row in values.items()
    ]
    paper = [[name, *map(number, values)] for name, values in UNSEEN_OBJECTS.items()]
    paper.append(["mean", *map(number, UNSEEN_FORCE["ODeform"])])
    return [
        "## I. Pushed objects, unseen contacts and forces",
        "",
        *paragraph(
            "One checkpoint for all seven objects (`contact-force`).",
            "Deformation is the error of what the best rigid motion of each frame leaves, relative to its size.",
            "The paper trains one network per object, on other meshes, materials and pushes.",
        ),
        "",
        *table(head, rows),
        *table(["paper, ODeform", "RMSE", "MAE", "MSE"], paper),
    ]


def _score(value: float, metric: str) -> str:
    return f"{100.0 * value:.0f} %" if metric == SHAPE else number(value)


def _unseen(runs: Runs, shipped: Mapping[str, Mapping[str, float]]) -> list[str]:
    asked = [(DROP, FRAMES[DROP]), (DROP, IMPACT), ("kick", FRAMES["kick"]), (FORCE, FRAMES[FORCE]), (FORCE, FINAL)]
    labels = ("drop", "its impact", "kick", "pushed objects", "their last frame")
    head = ["model", "parameters"]
    head += [f"{label}, {unit}" for label in labels for unit in ("RMSE", "MAE", "MSE")]
    rows = scored_rows(
        {
            model: [scores_of(runs, window, metric, scene=s, model=model) for s, window in asked for metric in METRICS]
            for model in models(runs)
        }
    )
    for row in rows:
        counts = [r["parameters"] for run, r in runs.items() if run.model == row[0] and run.scene == DROP]
        row.insert(1, f"{max(counts):,}" if counts else "–")
    longer = [number(shipped[f"{scene} {key_of(window)}"][metric]) for scene, window in asked for metric in METRICS]
    rows.append(["bundled checkpoint of ODeform", "", *longer])
    paper = [
        [name, *map(number, UNSEEN.get(name, (None,) * 3)), *map(number, UNSEEN_FORCE[name])] for name in UNSEEN_FORCE
    ]
    return [
        "## II. Unseen parameters",
        "",
        *paragraph(
            f"All frames of the drop (`mass-elastic`), its frames {IMPACT[0]} to {IMPACT[1] - 1} with the first two",
            "contacts, all frames of the kick, and all frames of pushed objects.",
            "`pe-gnn` predicts the last frame only; what others have there stands beside it.",
            "± is the standard deviation over seeds; `pod-rbf`, `gp` and `nearest` are deterministic.",
            "Here and below, bold is what leads all others of its column by more than the spread.",
        ),
        "",
        *table(head, rows),
        *table(["paper", "Mass-Elastic, RMSE", "MAE", "MSE", "Contact-Force, RMSE", "MAE", "MSE"], paper),
    ]


def _extrapolated(runs: Runs, simple: Mapping[str, Mapping[str, float]]) -> list[str]:
    windows = [(until, until + AHEAD) for until in UNTIL]
    head = ["model", *(f"{b - AHEAD} to {b - 1}, {unit}" for _, b in windows for unit in ("RMSE", "MAE"))]
    head += [f"pushed objects {PUSH[0]} to {PUSH[1] - 1}, {unit}" for unit in ("RMSE", "MAE")]
    scores = {}
    for model in models(runs):
        for kind, label in (("", model), (ALONE, f"{model} without continuation")):
            row = [scores_of(runs, w, m, kind, model=model, until=w[0]) for w in windows for m in METRICS[:2]]
            row += [scores_of(runs, PUSH, metric, kind, model=model, scene=FORCE) for metric in METRICS[:2]]
            if any(row):
                scores[label] = row
    rows = scored_rows(scores)
    for name, label in SIMPLE.items():
        scores = [simple[f"{name} {key_of(window)}"] for window in windows]
        rows.append([label, *(number(s[m]) for s in scores for m in METRICS[:2]), "–", "–"])
    paper = [[name, *map(number, (*EXTRAPOLATED[name], *EXTRAPOLATED_FORCE[name]))] for name in EXTRAPOLATED]
    return [
        "## III. Extrapolation",
        "",
        *paragraph(
            f"The {AHEAD} frames after the trained ones, at 120 Hz.",
            f"Drops are trained to frame {UNTIL[0] - 1}, when the stiffer balls have left the floor, or to frame",
            f"{UNTIL[1] - 1}, when some have landed again.",
            f"Pushed objects are trained to frame {PUSH[0] - 1} at 100 Hz, as in the paper.",
            "Models of reduced coordinates, rivals included, are continued by dynamics that are fitted to the training",
            "motions within the window; without it, baselines hold their last trained frame.",
            "`odeform-rolling` has no such continuation: its own ODE goes on.",
            "The true frames, continued, are the least error that this continuation leaves: its floor.",
        ),
        "",
        *table(head, rows),
        *table(["paper", "Mass-Elastic, RMSE", "MAE", "Contact-Force, RMSE", "MAE"], paper),
    ]


def _interpolated(runs: Runs, simple: Mapping[str, Mapping[str, float]]) -> list[str]:
    head = ["model", "every frame", *(f"every {_nth(k)}" for k in INTERVALS), *(f"{_nth(k)}, MAE" for k in INTERVALS)]
    tables = {}
    for stagger in (True, False):
        found = {}
        for model in models(runs, stagger=stagger, every=INTERVALS[0]):
            found[model] = [scores_of(runs, IMPACT, METRICS[0], model=model, every=1)]
            every = {"model": model, "stagger": stagger}
            for metric in METRICS[:2]:
                found[model] += [scores_of(runs, IMPACT, metric, every=k, **every) for k in INTERVALS]
        rows = scored_rows(found)
        splines = [simple[f"spline {k} staggered" if stagger else f"spline {k}"] for k in INTERVALS]
        errors = [number(one[metric]) for metric in METRICS[:2] for one in splines]
        tables[stagger] = table(head, [*rows, ["cubic spline through the true trained frames", "0", *errors]])
    paper = [[name, *map(number, values)] for name, values in INTERPOLATED.items()]
    return [
        "## IV. Interpolation",
        "",
        *paragraph(
            f"All frames {IMPACT[0]} to {IMPACT[1] - 1} of drops, by models trained on every 3rd, 5th or 8th frame;",
            "RMSE, then MAE.",
            "Trained frames are staggered between sequences (`--stagger`: the i-th keeps i, i + k, i + 2 k, ...):",
        ),
        "",
        *tables[True],
        *paragraph(
            "Trained frames are the same in all sequences.",
            "A contact lasts a few frames, so no sequence shows what happens between the trained ones.",
            "At test time `occupancy-flow` is given the true trained frames of the same motion, as in the paper, and",
            "the other models its parameters:",
        ),
        "",
        *tables[False],
        *table(["paper, RMSE", *(f"every {_nth(k)}" for k in INTERVALS)], paper),
    ]


def _nth(k: int) -> str:
    return f"{k}rd" if k == 3 else f"{k}th"


def _identified(identified: Mapping[str, Any]) -> list[str]:
    rows = [
        [scene, name, f"{one['mae_normalised']:.4f}", _covered(one), f"{result['seconds']:.1f} s",
         number(IDENTIFIED[name]) if scene == DROP else "–"]
        for scene, result in identified.items()
        for name, one in result["parameters"].items()
    ]  # fmt: skip
    return [
        "## V. Identification",
        "",
        *paragraph(
            "All parameters of a motion together, by the bundled checkpoints; MAE in halves of the trained range",
            "(`odeform identify`). The paper recovers one parameter at a time.",
        ),
        "",
        *table(["scene", "parameter", "MAE", "in 90 % interval", "time per sequence", "paper"], rows),
    ]


def _covered(one: Mapping[str, Any]) -> str:
    return "–" if one["coverage_90"] is None else f"{100 * one['coverage_90']:.0f} %"
