"""The seven objects: made from formulas, and drawn."""
