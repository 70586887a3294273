"""`python -m odeform.cli` is the `odeform` command."""

import sys

from odeform.cli import main

if __name__ == "__main__":
    sys.exit(main())
