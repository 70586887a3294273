"""The entry point of `odeform-viz`: Ctrl-C works before the rest of the package is imported, which takes a second."""

import sys

from odeform.cli.interrupts import interruptible

__all__ = ["main"]


def main() -> int:
    """Run `odeform_viz.cli.main`; returns its exit code."""
    with interruptible():
        from odeform_viz.cli import main as run

        return run()


if __name__ == "__main__":
    sys.exit(main())
