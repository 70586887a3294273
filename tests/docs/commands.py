"""The command lines of a bash block, and the argument parsers that have to accept them."""

import argparse
import shlex
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

import pytest

import odeform.cli
import odeform_viz.cli

__all__ = ["MAINS", "command_lines", "parser_of"]

MAINS: dict[str, Callable[[Sequence[str]], int]] = {"odeform": odeform.cli.main, "odeform-viz": odeform_viz.cli.main}


class _Parsed(Exception):
    """Carries the parser that accepted a command line."""


def command_lines(code: str) -> list[list[str]]:
    """The words of each command, with continuations joined and `&&` split."""
    commands: list[list[str]] = []
    for line in code.replace("\\\n", " ").splitlines():
        words: list[str] = []
        for word in [*shlex.split(line, comments=True), "&&"]:
            if word == "&&" and words:
                commands.append(words)
                words = []
            elif word != "&&":
                words.append(word)
    return commands


def parser_of(program: str, arguments: Sequence[str]) -> argparse.ArgumentParser:
    """The parser of a program once it has accepted the arguments; `SystemExit` where it refuses them."""
    parse = argparse.ArgumentParser.parse_args

    def stop_after(self: argparse.ArgumentParser, *args: Any, **keywords: Any) -> NoReturn:
        parse(self, *args, **keywords)
        raise _Parsed(self)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(argparse.ArgumentParser, "parse_args", stop_after)
        try:
            MAINS[program](arguments)
        except _Parsed as parsed:
            return parsed.args[0]
    raise AssertionError(f"{program} parsed no arguments")
