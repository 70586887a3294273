"""Each worked example of `docs/extending.md`, done as its reader would: in a copy of the packages.

A block with a title is a file. A `diff` block adds lines to one. All other blocks are run.
"""

import os
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from blocks import ROOT, Block, blocks_of
from commands import command_lines, parser_of

PORT = "8123"  # of the page's example; several tests may run at a time
PAGE = ROOT / "docs" / "extending.md"
EXAMPLES = {
    line[3:]: [b for b in blocks_of(PAGE) if number < b.line]
    for number, line in enumerate(PAGE.read_text().splitlines(), start=1)
    if line.startswith("## ")
}
ENDS = [*[blocks[0].line if blocks else 0 for blocks in EXAMPLES.values()][1:], 10**9]
EXAMPLES = {
    name: [b for b in blocks if b.line < end] for (name, blocks), end in zip(EXAMPLES.items(), ENDS, strict=True)
}


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def apply(block: Block, root: Path) -> None:
    """Make a file of a titled block, or insert the added lines of a `diff` after the line above them."""
    file = root / block.title
    if block.language != "diff":
        file.parent.mkdir(parents=True, exist_ok=True)
        assert not file.exists(), f"{block.where}: {block.title} is there already"
        file.write_text(block.code + "\n")
        return
    lines = file.read_text().splitlines()
    at = -1
    for line in block.code.splitlines():
        if line.startswith("+"):
            at += 1
            lines.insert(at, line[1:])
        else:
            assert line[1:] in lines, f"{block.where}: {block.title} has no line {line[1:]!r}"
            at = lines.index(line[1:])
    file.write_text("\n".join(lines) + "\n")


def script(blocks: list[Block]) -> str:
    """The blocks that are run, as one program; the viewer's commands are only parsed."""
    lines = ["from odeform.cli import main"]
    for block in blocks:
        if block.language == "python":
            lines.append(block.code)
        for program, *arguments in command_lines(block.code) if block.language == "bash" else ():
            if program == "odeform":
                lines.append(f"assert main({arguments!r}) == 0")
            elif program == "odeform-viz":
                parser_of(program, arguments)
    return "\n".join(lines)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, blocks in EXAMPLES.items() if blocks])
def test_the_example_works(name: str, tmp_path: Path):
    for package in ("odeform", "odeform_viz"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "assets").symlink_to(ROOT / "assets")
    blocks = EXAMPLES[name]
    for block in blocks:
        if block.title:
            apply(block, tmp_path)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "OMP_NUM_THREADS": "1"}
    program = tmp_path / "example.py"
    program.write_text(script([b for b in blocks if not b.title]).replace(PORT, str(free_port())))
    ran = subprocess.run([sys.executable, program], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    linted = subprocess.run(
        [sys.executable, "-m", "ruff", "check", "--config", str(ROOT / "pyproject.toml"), "odeform", "odeform_viz"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert linted.returncode == 0, linted.stdout


def test_the_page_has_an_example_of_each_kind():
    titles = " ".join(EXAMPLES).lower()
    assert all(kind in titles for kind in ("scene", "baseline", "export format", "panel", "solver"))
