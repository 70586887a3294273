"""Two sections of the page of tables: what each part of ODeform gives, and what fewer training sequences cost."""

from collections.abc import Sequence
from typing import Any

from odeform_figures.tables.cells import Runs, models, paragraph, scored_rows, scores_of, table
from odeform_figures.tables.plan import ABLATED, FEWER, FRAMES

__all__ = ["ablations", "learning_curve"]

PAIR = ("RMSE", "deformation, %")
LABELS = {
    "residual": "the regression of what is left",
    "ode": "the ODE: states stay as they start",
    "clock": "the clock of the decoders",
    "parameters": "the parameters of the decoders",
    "random-features": "random features",
    "network": "the network of the contact coefficients",
    "corners": "the corners of the mesh, and the place that it rested on",
}


def ablations(runs: Runs) -> list[str]:
    """Rows by what was left out, columns by model and scene."""
    head = ["without", *(f"{model} on {scene}, {unit}" for model, scene in ABLATED for unit in PAIR)]
    all_parts = dict.fromkeys(parts for of in ABLATED.values() for parts in of)
    scores = {
        _label(parts): [cell for model, scene in ABLATED for cell in _pair(runs, scene, model=model, without=parts)]
        for parts in all_parts
    }
    if not any(any(row) for row in scores.values()):
        return []
    return [
        "## Ablations",
        "",
        *paragraph(
            "Models without some of their parts, trained again with the same steps (`--without`).",
            "A dash was not run, or is a part that the model or the scene does not have.",
            "Without the regression of what is left unexplained, the ODE is on its own.",
            "Deformation is relative, as elsewhere.",
        ),
        "",
        *table(head, scored_rows(scores)),
    ]


def _label(parts: Sequence[str]) -> str:
    """Says in words what a row leaves out."""
    return "; ".join(LABELS[part] for part in sorted(parts, key=list(LABELS).index)) or "nothing"


def _pair(runs: Runs, scene: str, **attributes: Any) -> list[list[float]]:
    """Pooled RMSE in mm and deformation error in per cent, one of each per seed."""
    rmse, deformation = (
        scores_of(runs, FRAMES[scene], metric, scene=scene, **attributes)
        for metric in ("rmse_pooled_mm", "deformation_relative")
    )
    return [rmse, [100.0 * value for value in deformation]]


def learning_curve(runs: Runs) -> list[str]:
    """Returns a table for each scene: models by number of training sequences."""
    sections = []
    for scene, counts in FEWER.items():
        names = models(runs, scene=scene)
        sizes = [*counts, None]
        rows = scored_rows(
            {
                model: [cell for count in sizes for cell in _pair(runs, scene, model=model, sequences=count)]
                for model in names
            }
        )
        labels = [*map(str, counts), "all"]
        head = [scene, *(f"{label}, {unit}" for label in labels for unit in PAIR)]
        sections += table(head, rows) if names else []
    if not sections:
        return []
    return [
        "## Learning curve",
        "",
        *paragraph(
            "Trained on the first so many training sequences (`--sequences`), with the same steps;",
            "validation and test are the same.",
        ),
        "",
        *sections,
    ]
