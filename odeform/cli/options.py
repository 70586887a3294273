"""Arguments that several commands share, and how their values are read and written."""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from odeform.errors import InputError, one_line

__all__ = [
    "Parser",
    "add_checkpoint",
    "add_cluster",
    "add_data",
    "add_json",
    "add_part",
    "add_plugin",
    "add_quality",
    "add_seed",
    "add_split",
    "add_window",
    "load_plugins",
    "parse_part",
    "parse_settings",
    "parse_window",
    "positive",
    "write_json",
]

CHECKPOINT = "checkpoint file (.safetensors, or .pth of the paper's authors), or bundled: kick, kick/pod-rbf, ..."
DATA = "data set: a folder, an .odp file, or the name of a bundled one"


class Parser(argparse.ArgumentParser):
    """Prints its errors in one line of a readable length."""

    def error(self, message: str) -> NoReturn:
        super().error(one_line(message))


def add_checkpoint(parser: argparse.ArgumentParser, default: str | None = None) -> None:
    """CKPT, optional where there is a default."""
    if default is None:
        parser.add_argument("checkpoint", metavar="CKPT", help=CHECKPOINT)
    else:
        text = f"{CHECKPOINT} (default: {default})"
        parser.add_argument("checkpoint", nargs="?", default=default, metavar="CKPT", help=text)


def add_data(parser: argparse.ArgumentParser, required: bool = True, text: str = DATA) -> None:
    """Adds --data DATASET."""
    parser.add_argument("--data", required=required, metavar="DATASET", help=text)


def add_split(parser: argparse.ArgumentParser) -> None:
    """Adds --split."""
    splits = ("train", "val", "test", "all")
    parser.add_argument("--split", default="test", choices=splits, help="sequences to use (default: test)")


def add_part(parser: argparse.ArgumentParser) -> None:
    """Adds --part, read by `parse_part`."""
    text = "use part K of N of these sequences: every N-th of each object (default: all)"
    parser.add_argument("--part", metavar="K/N", help=text)


def parse_part(text: str | None) -> tuple[int, int]:
    """Parses K/N, as `Dataset.part` takes it; 1, 1 for None."""
    try:
        index, count = (1, 1) if text is None else (int(number) for number in text.split("/"))
    except ValueError:
        raise InputError(f"--part: expected K/N, got {text!r}") from None
    return index, count


def add_window(parser: argparse.ArgumentParser, purpose: str) -> None:
    """--window A:B, read by `parse_window`."""
    text = f"frames to {purpose}, half-open: from A up to but excluding B (default: all)"
    parser.add_argument("--window", metavar="A:B", help=text)


def add_quality(parser: argparse.ArgumentParser) -> None:
    """Adds --quality NAME."""
    text = "solver settings: draft, balanced (default) or reference"
    parser.add_argument("--quality", default="balanced", metavar="NAME", help=text)


def add_seed(parser: argparse.ArgumentParser, purpose: str) -> None:
    """Adds --seed S."""
    parser.add_argument("--seed", type=int, default=0, metavar="S", help=f"random seed of {purpose} (default: 0)")


def add_cluster(parser: argparse.ArgumentParser, needs: str = "") -> None:
    """Adds --cluster ADDRESS, of `odeform.cluster.on_cluster`."""
    text = f"work on the workers of this Dask scheduler, tcp://HOST:PORT, instead of this machine{needs}"
    parser.add_argument("--cluster", metavar="ADDRESS", help=text)


def add_json(parser: argparse.ArgumentParser, text: str = "also write the result to this file, as JSON") -> None:
    """Adds --json FILE."""
    parser.add_argument("--json", metavar="FILE", help=text)


def add_plugin(parser: argparse._ActionsContainer) -> None:
    """Adds --plugin FILE, for `load_plugins`."""
    text = "run this Python file first, which registers models of your own (may be repeated)"
    parser.add_argument("--plugin", action="append", default=[], metavar="FILE.py", help=text)


def load_plugins(files: Sequence[str]) -> None:
    """Run the files of --plugin; `InputError` for one that is not there, and what their code raises as it is."""
    if files:
        from odeform.models.plugins import load_plugin

        for file in files:
            load_plugin(file)


def parse_settings(pairs: Sequence[str], option: str = "--set") -> dict[str, str]:
    """NAME=VALUE ... as names and values, which are not converted."""
    settings = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not equals or not name:
            raise InputError(f"{option}: expected NAME=VALUE, got {pair!r}")
        settings[name] = value
    return settings


def parse_window(text: str | None) -> tuple[int, int] | None:
    """Parses A:B as two frame numbers."""
    if text is None:
        return None
    try:
        begin, end = (int(part) for part in text.split(":"))
    except ValueError:
        raise InputError(f"--window: expected A:B in frames, got {text!r}") from None
    if not 0 <= begin < end:
        raise InputError(f"--window: expected 0 <= A < B, got {text!r}")
    return begin, end


def positive(option: str, value: int | float) -> None:
    """`InputError` for a value that is not positive and finite."""
    if not 0.0 < value < float("inf"):
        raise InputError(f"{option}: expected a positive number, got {value:g}")


def write_json(result: dict[str, Any], path: str | None) -> None:
    """Write the file of --json, if one is asked for."""
    if path:
        from odeform.io import atomic_write

        atomic_write(Path(path), json.dumps(result, indent=1).encode())
