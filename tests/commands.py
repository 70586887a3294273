"""Commands as a shell gives them."""

from odeform.cli import main

__all__ = ["run"]


def run(*arguments: object) -> int:
    """Run `odeform` with arguments of any kind; returns its exit code."""
    return main([str(argument) for argument in arguments])
