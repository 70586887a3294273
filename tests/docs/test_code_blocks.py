"""Every code block of the README and the docs works as printed."""

import ast
import importlib
import importlib.util
import json
from pathlib import Path

import pytest
from blocks import ROOT, Block, blocks_of, pages
from commands import MAINS, command_lines, parser_of
from files import make_files

PROGRAMS = {*MAINS, "git", "lint-imports", "mkdocs", "pip", "pre-commit", "pyright", "pytest", "python", "ruff"}
LANGUAGES = {"bash", "bibtex", "csv", "diff", "json", "nginx", "python", "text", "toml", "yaml"}
BLOCKS = [block for page in pages() for block in blocks_of(page)]
WORKED = ROOT / "docs" / "extending.md"  # its blocks are files of an extension: test_extending.py


def of(language: str, *marks: str) -> list[Block]:
    return [b for b in BLOCKS if b.language == language and (not marks or b.mark in marks)]


def python_pages(slow: bool) -> list[Path]:
    """Pages with Python blocks: all that have a slow one, or all others."""
    marked = {b.page for b in of("python", "slow")}
    return sorted({b.page for b in of("python") if b.page != WORKED and (b.page in marked or not slow)})


def run_python(page: Path, slow: bool) -> None:
    """The blocks of a page in order, in one namespace; lines of tracebacks are those of the page."""
    namespace: dict[str, object] = {"__name__": "docs"}
    for block in (b for b in blocks_of(page) if b.language == "python"):
        if not block.mark.startswith("skip") and (slow or block.mark != "slow"):
            exec(compile("\n" * block.line + block.code, str(page), "exec"), namespace)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A temporary working folder with the files that pages take for granted."""
    make_files(tmp_path)
    monkeypatch.chdir(tmp_path)


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("page", python_pages(slow=False), ids=lambda p: p.stem)
def test_python_blocks_run(page: Path):
    run_python(page, slow=False)


@pytest.mark.slow
@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("page", python_pages(slow=True), ids=lambda p: p.stem)
def test_long_python_blocks_run(page: Path):
    run_python(page, slow=True)


@pytest.mark.parametrize("block", of("bash"), ids=lambda b: b.where)
def test_commands_exist_with_these_options(block: Block):
    for words in command_lines(block.code):
        program, *arguments = words
        assert program in PROGRAMS, f"{block.where}: unknown program {program}"
        if program in MAINS:
            parser_of(program, arguments)
        elif program == "python" and arguments[0] == "-m":
            assert importlib.util.find_spec(arguments[1]), f"{block.where}: no module {arguments[1]}"
        elif program == "python":
            assert (ROOT / arguments[0]).is_file(), f"{block.where}: no file {arguments[0]}"


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("block", of("bash", "run"), ids=lambda b: b.where)
def test_quick_commands_run(block: Block, capsys: pytest.CaptureFixture[str]):
    for program, *arguments in command_lines(block.code):
        assert MAINS[program](arguments) == 0, capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("block", of("bash", "slow"), ids=lambda b: b.where)
def test_long_commands_run(block: Block, capsys: pytest.CaptureFixture[str]):
    for program, *arguments in command_lines(block.code):
        assert MAINS[program](arguments) == 0, capsys.readouterr().err


@pytest.mark.parametrize("block", of("json"), ids=lambda b: b.where)
def test_json_blocks_are_valid(block: Block):
    json.loads(block.code)


@pytest.mark.parametrize("block", of("python"), ids=lambda b: b.where)
def test_python_blocks_are_valid_and_not_too_wide(block: Block):
    ast.parse(block.code)
    assert max(map(len, block.code.splitlines())) <= 120


def test_every_block_names_a_known_language():
    assert {b.language for b in BLOCKS} <= LANGUAGES, [b.where for b in BLOCKS if b.language not in LANGUAGES]


def test_every_mark_is_known_and_every_skip_has_a_reason():
    marks = {b.mark for b in BLOCKS}
    assert all(mark in ("", "run", "slow") or mark.startswith("skip, ") for mark in marks), marks
