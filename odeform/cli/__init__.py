"""The `odeform` command. Each subcommand is one module here, listed in `odeform.cli.entry.COMMANDS`,
or of another package, by an entry point in the group `odeform.commands`."""

from odeform.cli.entry import main, run_guarded

__all__ = ["main", "run_guarded"]
