"""The parser of all commands, and how errors become exit codes."""

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from odeform.cli import (
    bench,
    evaluate,
    identify,
    import_,
    info,
    pack,
    predict,
    simulate,
    stress,
    train,
)
from odeform.cli.interrupts import interruptible
from odeform.cli.options import Parser, add_plugin, load_plugins
from odeform.errors import FailedCheck, InputError, one_line

__all__ = ["COMMANDS", "Command", "commands", "main", "run_guarded"]


@runtime_checkable
class Command(Protocol):
    """Describes what the module of a command provides."""

    @property
    def HELP(self) -> str:
        """One line for the list of commands."""
        ...

    def add_options(self, parser: argparse.ArgumentParser) -> None:
        """Declare the arguments; called only when this command is chosen."""
        ...

    def run(self, args: argparse.Namespace) -> None:
        """Do the work. `InputError` when the input is at fault."""
        ...


COMMANDS: dict[str, Command] = {
    "simulate": simulate,
    "import": import_,
    "pack": pack,
    "train": train,
    "evaluate": evaluate,
    "predict": predict,
    "identify": identify,
    "bench": bench,
    "stress": stress,
    "info": info,
}


def commands() -> dict[str, Command]:
    """Returns `COMMANDS`, and those that installed packages declare (`odeform.cli.declared`)."""
    from odeform.cli.declared import declared_commands  # reading entry points takes time

    return COMMANDS | declared_commands()


class _Parser(Parser):
    """Adds its options when it first parses: the options of other commands would cost their imports."""

    command: Command | None = None

    def parse_known_args(self, *args: Any, **kwargs: Any) -> Any:
        if self.command is not None:
            self.set_defaults(run=self.command.run)
            self.command.add_options(self)
            add_plugin(self)
            self.command = None
        return super().parse_known_args(*args, **kwargs)


class _Version(argparse.Action):
    """Looks the version up when it is asked for, not at every start."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        import odeform

        print(f"odeform {odeform.__version__}")
        parser.exit()


def run_guarded(work: Callable[[], None]) -> int:
    """Run `work` and return the exit code: 0, 1 for a check that fails and 2 for faulty input, both with one line on
    standard error, 130 for Ctrl-C."""
    try:
        work()
    except InputError as error:
        print(f"error: {one_line(error)}", file=sys.stderr)
        return 2
    except FailedCheck as failure:
        print(f"failed: {failure}", file=sys.stderr)
        return 1
    except OSError as error:
        named = f"{error.filename}: {error.strerror}" if error.filename and error.strerror else error
        print(f"error: {one_line(named)}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted; finished work is kept", file=sys.stderr)
        return 130
    return 0


def main(argv: Sequence[str] | None = None) -> int:
    """Run the `odeform` command with the arguments `argv` (default: those of this process); return its exit code."""
    with interruptible():
        return _main(argv)


def _main(argv: Sequence[str] | None) -> int:
    first = next(iter(sys.argv[1:] if argv is None else argv), "")
    known = COMMANDS if first in COMMANDS else commands()
    if first not in known and (code := run_guarded(lambda: _refuse_absent(first))):
        return code
    args = _parser_of(known).parse_args(argv)
    missing = _missing_folders(args)

    def work() -> None:
        load_plugins(args.plugin)
        args.run(args)

    code = run_guarded(work)
    for folder in (folder for folder in missing if folder.exists()):
        print(f"note: created the folder {folder}", file=sys.stderr)
    return code


def _refuse_absent(name: str) -> None:
    from odeform.cli.declared import refuse_absent

    refuse_absent(name)


def _parser_of(known: Mapping[str, Command]) -> argparse.ArgumentParser:
    parser = _Parser(prog="odeform", description="Simulate, train, evaluate and run models of soft-body motion.")
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and exit")
    listed = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, command in known.items():
        listed.add_parser(name, help=command.HELP, description=f"{command.HELP}.").command = command
    return parser


def _missing_folders(args: argparse.Namespace) -> list[Path]:
    """The folders of the files that a command writes, where they do not exist yet."""
    files = (getattr(args, name, None) for name in ("out", "json", "map"))
    folders = dict.fromkeys(Path(file).parent for file in files if file)
    return [folder for folder in folders if not folder.exists()]
