"""The parser of all commands, and how errors become exit codes."""

import argparse
import sys
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from odeform.cli import bench, evaluate, identify, import_, info, pack, predict, simulate, stress, tables, train
from odeform.errors import InputError

__all__ = ["COMMANDS", "Command", "main", "run_guarded"]


class Command(Protocol):
    """What the module of a command provides."""

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
    "tables": tables,
    "evaluate": evaluate,
    "predict": predict,
    "identify": identify,
    "bench": bench,
    "stress": stress,
    "info": info,
}


class _Parser(argparse.ArgumentParser):
    """Adds its options when it first parses: the options of other commands would cost their imports."""

    command: Command | None = None

    def parse_known_args(self, *args: Any, **kwargs: Any) -> Any:
        if self.command is not None:
            self.set_defaults(run=self.command.run)
            self.command.add_options(self)
            self.command = None
        return super().parse_known_args(*args, **kwargs)


class _Version(argparse.Action):
    """Looks the version up when it is asked for, not at every start."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        import odeform

        print(f"odeform {odeform.__version__}")
        parser.exit()


def run_guarded(work: Callable[[], None]) -> int:
    """Run `work` and return the exit code: 0, 2 with one line on standard error for faulty input, 130 for Ctrl-C."""
    try:
        work()
    except (InputError, OSError) as error:
        print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted; finished work is kept", file=sys.stderr)
        return 130
    return 0


def main(argv: Sequence[str] | None = None) -> int:
    """Run the `odeform` command with the arguments `argv` (default: those of this process); return its exit code."""
    parser = _Parser(prog="odeform", description="Simulate, train, evaluate and run models of soft-body motion.")
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and exit")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, command in COMMANDS.items():
        commands.add_parser(name, help=command.HELP, description=f"{command.HELP}.").command = command
    args = parser.parse_args(argv)
    return run_guarded(lambda: args.run(args))
