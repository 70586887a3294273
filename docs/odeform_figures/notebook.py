"""The executed notebook of the documentation: `python -m odeform_figures.notebook` writes docs/notebook.ipynb.

Each cell runs in one namespace, as a kernel runs it; what it prints, and the value of its last line, are its output.
"""

import argparse
import ast
import contextlib
import io
import json
import sys
from pathlib import Path
from typing import Any

from odeform.io import atomic_write

__all__ = ["CELLS", "build", "main"]

CELLS: tuple[tuple[str, str], ...] = (
    (
        "markdown",
        "# ODeform in a notebook\n\nA model is a function of parameters and time. `odeform_viz.show` puts its page "
        "into the notebook; a figure with sliders stays in the file, and needs no server.\n\n"
        "Written by `python -m odeform_figures.notebook`.",
    ),
    ("code", 'import numpy as np\n\nimport odeform\nimport odeform_viz\n\npredictor = odeform.load("mass-elastic")'),
    (
        "code",
        'motion = predictor.solve(parameters={"mass": 0.6})  # kg; the rest at their defaults\n'
        "times = np.linspace(0.0, 1.0, 5)  # s\n"
        "for time, deformation in zip(times, 1e3 * motion.deformation_rms(times), strict=True):\n"
        '    print(f"{time:.2f} s: {deformation:.2f} mm RMS deformation")',
    ),
    (
        "markdown",
        "The page. Its sliders are read and moved from Python. It is served to this machine, so that its frame is "
        "empty where the notebook is only read.",
    ),
    (
        "code",
        'page = odeform_viz.show(predictor, height=560)\npage.parameters["mass"] = 0.8  # moves the slider\n'
        "page.time = 0.25\n{name: round(value, 3) for name, value in page.parameters.items()}",
    ),
    ("code", "page.close()"),
    (
        "markdown",
        "A figure that moves, with a slider for the mass: motions on a grid, interpolated in the browser. How far it "
        "is from the model is measured when it is made, and printed in it.",
    ),
    (
        "code",
        "from odeform.figure import Source, Sweep, figure_page, interpolated\n\n"
        'mass = next(p for p in predictor.schema.parameters if p.name == "mass")\n'
        "source = Source(predictor, (Sweep(mass, mass.low, mass.high),), {})\n"
        "moments = np.linspace(0.0, 1.0, 101)  # s\n"
        'column = interpolated("ODeform", source, moments, 400_000)\n'
        "odeform_viz.figure(figure_page([column]), height=520)",
    ),
)
"""Kind and source of each cell."""


def build(cells: tuple[tuple[str, str], ...] = CELLS) -> bytes:
    """Runs the cells and returns the notebook with their outputs, as JSON of format 4.5. Raises what a cell raises."""
    space: dict[str, Any] = {"__name__": "__main__"}
    made, count = [], 0
    for index, (kind, source) in enumerate(cells):
        cell: dict[str, Any] = {"cell_type": kind, "id": f"cell-{index}", "metadata": {}, "source": source}
        if kind == "code":
            count += 1
            cell |= {"execution_count": count, "outputs": _run(source, space, count)}
        made.append(cell)
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    whole = {"cells": made, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(whole, indent=1, ensure_ascii=False).encode()


def _run(source: str, space: dict[str, Any], count: int) -> list[dict[str, Any]]:
    """The outputs of one cell."""
    tree = ast.parse(source)
    end = tree.body[-1] if tree.body else None
    last = ast.Expression(end.value) if isinstance(end, ast.Expr) else None
    if last is not None:
        tree.body.pop()
    printed, value = io.StringIO(), None
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, "cell", "exec"), space)
        if last is not None:
            value = eval(compile(last, "cell", "eval"), space)
    outputs: list[dict[str, Any]] = []
    if printed.getvalue():
        outputs.append({"output_type": "stream", "name": "stdout", "text": printed.getvalue()})
    if value is not None:
        data = {"text/plain": repr(value) if not hasattr(value, "_repr_html_") else f"<{type(value).__name__}>"}
        if hasattr(value, "_repr_html_"):
            data["text/html"] = value._repr_html_()
        outputs.append({"output_type": "execute_result", "execution_count": count, "metadata": {}, "data": data})
    return outputs


def main() -> int:
    """Run the command; returns its exit code."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.notebook", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/notebook.ipynb"), help="default: docs/notebook.ipynb")
    out = parser.parse_args().out
    atomic_write(out, build())
    print(f"{out}: {out.stat().st_size / 1e6:.2f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
