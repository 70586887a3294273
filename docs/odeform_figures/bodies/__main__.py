"""Rebuild the bundled objects: `python -m odeform_figures.bodies [NAME ...]`."""

import argparse
import sys
from collections.abc import Sequence

import numpy as np

from odeform.io import atomic_open, bundled
from odeform.simulation.objects.catalog import OBJECTS
from odeform.simulation.objects.files import arrays_of
from odeform_figures.bodies.generate import generate

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> None:
    """Make the named objects (default: all) and write their files."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.bodies", description="Rebuild the objects.")
    parser.add_argument("names", metavar="NAME", nargs="*", default=OBJECTS, help=f"of {', '.join(OBJECTS)}")
    for name in parser.parse_args(argv).names:
        item = generate(name)
        with atomic_open(bundled("objects") / f"{name}.npz") as file:
            np.savez_compressed(file, **arrays_of(item))
        print(
            f"{name}: {item.surface_count} surface vertices, {len(item.points)} nodes, {len(item.elements)} elements, "
            f"{item.mass:.4g} kg, {1e3 * item.thickness:.0f} mm thick"
        )


if __name__ == "__main__":
    sys.exit(main())
