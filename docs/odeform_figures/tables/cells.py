"""Makes what sections of the page of tables consist of: paragraphs, tables, and scores of runs."""

import textwrap
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from odeform_figures.tables.runs import Result, Run

__all__ = ["Runs", "key_of", "models", "number", "paragraph", "scored_rows", "scores_of", "spread", "table"]

Row = Sequence[str]
Runs = Mapping[Run, Result]


def paragraph(*parts: str) -> list[str]:
    """Returns the lines of Markdown of at most 118 characters."""
    return textwrap.wrap(" ".join(parts), 118, break_long_words=False, break_on_hyphens=False)


def table(head: Row, rows: Iterable[Row]) -> list[str]:
    """Returns the lines of a Markdown table, and an empty one."""
    return ["| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *rows)] + [""]


def number(value: float | None) -> str:
    """Returns three significant digits, all digits from 1,000 on; a dash for None."""
    if value is None:
        return "–"
    return f"{value:.0f}" if value >= 1000.0 else f"{value:.3g}"


def spread(values: Sequence[float]) -> str:
    """Returns the mean and standard deviation over seeds."""
    if not values:
        return "–"
    return number(float(np.mean(values))) + (f" ± {_deviation(values):.2g}" if len(values) > 1 else "")


def _deviation(values: Sequence[float]) -> float:
    """The standard deviation; 0 for a single value."""
    return float(np.std(values, ddof=1)) if len(values) > 1 else 0.0


def scored_rows(scores: Mapping[str, Sequence[Sequence[float]]]) -> list[list[str]]:
    """Returns rows of a table from the scores of its columns, one for each seed, by the label of the row."""
    columns = [_led(column) for column in zip(*scores.values(), strict=True)]
    return [[label, *row] for label, row in zip(scores, zip(*columns, strict=True), strict=True)]


def _led(column: Sequence[Sequence[float]]) -> list[str]:
    """The scores of a column, in bold what leads all others by more than the spread of both."""
    cells = [spread(values) for values in column]
    known = sorted((i for i, values in enumerate(column) if values), key=lambda i: np.mean(column[i]))
    if len(known) > 1:
        best, *others = known
        leads = [np.mean(column[i]) - np.mean(column[best]) - _deviation(column[i]) for i in others]
        if min(leads) > _deviation(column[best]) and cells[best] not in [cells[i] for i in others]:
            cells[best] = f"**{cells[best]}**"
    return cells


def key_of(window: tuple[int, int]) -> str:
    """The key of a window of frames in the scores of a run: A:B."""
    return f"{window[0]}:{window[1]}"


def scores_of(runs: Runs, window: tuple[int, int], metric: str, kind: str = "", **attributes: object) -> list[float]:
    """A score of the runs with these attributes, one per seed."""
    found = [r for run, r in runs.items() if all(getattr(run, key) == value for key, value in attributes.items())]
    key = key_of(window) + kind
    return [r["scores"][key][metric] for r in found if key in r["scores"]]


def models(runs: Runs, **attributes: object) -> list[str]:
    """Names of the models of the runs with these attributes, in order."""
    return list(
        dict.fromkeys(run.model for run in runs if all(getattr(run, key) == v for key, v in attributes.items()))
    )
