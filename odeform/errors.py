"""The one error that means: what the user handed us is at fault."""

__all__ = ["InputError"]


class InputError(ValueError):
    """One clear line naming what was expected and what came; command lines exit with 2 on it."""
