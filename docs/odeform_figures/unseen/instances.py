"""Other instances of the seven classes: one of moderate, random proportions, and one at the ends of the ranges."""

from odeform_figures.bodies.generate import proportions

__all__ = ["EXTREMES", "factors_of"]


EXTREMES: dict[str, dict[str, float]] = {
    "bottle": {"girth": 0.85, "height": 1.15, "waist": 0.85, "neck": 1.25},
    "cat": {"girth": 1.15, "height": 0.9, "head": 1.12, "ears": 1.3, "tail": 0.85},
    "dog": {"length": 1.15, "girth": 0.88, "legs": 0.8, "muzzle": 1.3, "ears": 1.25},
    "donut": {"ring": 0.85, "tube": 1.15, "height": 1.1},
    "chip": {"size": 1.2, "length": 1.2, "saddle": 0.5, "corners": 1.3},
    "flip-flop": {"length": 0.88, "width": 1.12, "sole": 1.25, "strap": 1.2},
    "pillow": {"length": 1.15, "width": 1.2, "fill": 1.15, "corners": 1.4},
}
"""A slim bottle, a stout cat, a dachshund, a thick donut, a large flat chip, a child's flip-flop, a large pillow."""
RANDOM = 1  # seed of the moderate proportions


def factors_of(name: str) -> dict[str, dict[str, float]]:
    """Returns the proportions of both instances of a class, by the names of the instances."""
    return {f"{name}-moderate": proportions(name, RANDOM), f"{name}-extreme": EXTREMES[name]}
