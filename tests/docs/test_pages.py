"""The README and the docs: size, links, the page of commands, and the site."""

import argparse
import re
import subprocess
import sys
from pathlib import Path

import pytest
from blocks import ROOT, blocks_of, pages, prose
from commands import parser_of

import odeform
from odeform.cli.entry import Command, commands
from odeform.models.names import ALIASES, TRAINABLE

LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")


def slug(heading: str) -> str:
    return re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", heading.replace("`", "").strip().lower()))


def anchors(page: Path) -> set[str]:
    return {slug(heading) for heading in re.findall(r"^#+ (.+)$", page.read_text(), re.MULTILINE)}


def test_the_readme_is_short():
    assert len((ROOT / "README.md").read_bytes()) <= 6000


def test_the_readme_has_the_test_command_that_ci_runs():
    readme = (ROOT / "README.md").read_text()
    assert "<!-- test -->\n```bash\npip install -e '.[dev]' && pytest\n```" in readme
    assert "```bash\npip install -e . && odeform-viz\n```" in readme


@pytest.mark.parametrize("page", pages(), ids=lambda p: p.stem)
def test_links_lead_somewhere(page: Path):
    for target in LINK.findall(prose(page)):
        if target.startswith(("https://", "mailto:")):
            continue
        name, _, anchor = target.partition("#")
        file = (page.parent / name).resolve() if name else page
        assert file.exists(), f"{page.name}: {target} does not exist"
        assert not anchor or anchor in anchors(file), f"{page.name}: {target}: no such heading"


def test_every_page_is_in_the_menu():
    listed = set(re.findall(r"- ([\w-]+\.md)$", (ROOT / "mkdocs.yml").read_text(), re.MULTILINE))
    assert listed == {page.name for page in (ROOT / "docs").glob("*.md")}


def section(page: Path, heading: str) -> str:
    """The text under a heading, up to the next one of its level."""
    match = re.search(rf"^### {re.escape(heading)}$(.*?)(?=^##|\Z)", page.read_text(), re.MULTILINE | re.DOTALL)
    assert match, f"{page.name}: no section {heading}"
    return match[1]


def options(parser: argparse.ArgumentParser) -> set[str]:
    return {option for action in parser._actions for option in action.option_strings if option.startswith("--")}


def options_of(command: Command) -> set[str]:
    parser = argparse.ArgumentParser()
    command.add_options(parser)
    return options(parser)


def documented(text: str) -> set[str]:
    rows = [line.split("|")[1] for line in text.splitlines() if line.startswith("|")]
    return {option for row in rows for option in re.findall(r"`(--[\w-]+)`", row)}


def test_the_page_of_commands_has_every_command_and_option():
    page = ROOT / "docs" / "cli.md"
    expected = {f"odeform {name}": options_of(command) for name, command in commands().items()}
    expected["odeform-viz"] = options(parser_of("odeform-viz", []))
    for name, its in expected.items():
        assert documented(section(page, name)) == its - {"--help", "--version"}, name


@pytest.mark.parametrize("page", pages(), ids=lambda p: p.stem)
def test_commands_in_sentences_exist_with_these_options(page: Path):
    known = {f"odeform {name}": options_of(command) for name, command in commands().items()}
    known |= {"odeform": {"--version"}, "odeform-viz": options(parser_of("odeform-viz", []))}
    for code in re.findall(r"`(odeform(?:-viz)?(?: [^`]+)?)`", page.read_text()):
        words = code.split()
        command = " ".join(words[:2]) if words[0] == "odeform" and not words[-1].startswith("--version") else words[0]
        if code in ("odeform", "odeform_viz"):  # also the names of a model and of a package
            continue
        assert command in known, f"{page.name}: {code}"
        given = {word for word in words if word.startswith("--")}
        assert given <= known[command], f"{page.name}: {code}"


@pytest.mark.parametrize("package", ["odeform", "odeform_viz"])
def test_the_page_of_architecture_has_every_package(package: str):
    modules = {
        file.stem for file in (ROOT / package).iterdir() if not file.name.startswith(("_", "py.typed", "assets"))
    }
    named = set(re.findall(r"`([a-z_]+)/?`", (ROOT / "docs" / "architecture.md").read_text()))
    assert modules <= named


def test_the_reference_has_every_public_name():
    named = re.findall(r"^::: odeform\.(\w+)$", (ROOT / "docs" / "reference.md").read_text(), re.MULTILINE)
    assert {*named, "__version__"} == set(odeform.__all__)


def test_the_page_of_baselines_has_every_model():
    rows = re.findall(r"^\| (`[^|]+`) \|", (ROOT / "docs" / "baselines.md").read_text(), re.MULTILINE)
    named = {name for row in rows for name in re.findall(r"`([\w-]+)`", row)}
    assert {"latent", "rolling", "modal", *named} == set(TRAINABLE) - set(ALIASES)


def test_a_block_that_is_never_closed_is_an_error(tmp_path: Path):
    page = tmp_path / "page.md"
    page.write_text("```python\nprint(1)\n")
    with pytest.raises(ValueError, match="not in list"):
        blocks_of(page)


@pytest.mark.slow
def test_the_site_builds_without_warnings(tmp_path: Path):
    pytest.importorskip("mkdocs")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)]
    built = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert built.returncode == 0, built.stderr
