"""The notebook of the documentation: cells run in one namespace, and their outputs are kept."""

import json
from pathlib import Path

import pytest

from odeform_figures import notebook

MOST_BYTES = 1_500_000


def test_cells_share_a_namespace_and_keep_what_they_say() -> None:
    cells = (("markdown", "# Title"), ("code", "x = 2\nprint(x)"), ("code", "x = x + 1\nx"), ("code", "x;pass"))
    made = json.loads(notebook.build(cells))["cells"]
    assert "outputs" not in made[0]
    assert made[1]["outputs"] == [{"output_type": "stream", "name": "stdout", "text": "2\n"}]
    assert made[2]["outputs"][0]["data"] == {"text/plain": "3"}
    assert made[3]["outputs"] == []
    assert [cell.get("execution_count") for cell in made] == [None, 1, 2, 3]


def test_a_cell_that_fails_makes_no_notebook() -> None:
    with pytest.raises(ZeroDivisionError):
        notebook.build((("code", "1 / 0"),))


def test_the_notebook_is_that_of_the_command_and_light() -> None:
    path = Path("docs/notebook.ipynb")
    cells = json.loads(path.read_text())["cells"]
    assert [(cell["cell_type"], cell["source"]) for cell in cells] == list(notebook.CELLS)
    assert "iframe" in cells[-1]["outputs"][0]["data"]["text/html"]
    assert path.stat().st_size < MOST_BYTES
