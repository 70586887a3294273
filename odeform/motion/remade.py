"""Objects that are pickled as what they were made from."""

from collections.abc import Callable
from typing import Any

__all__ = ["Remade"]


class Remade:
    """Holds what `made_by` (a function and its arguments) returned. Pickles and copies hold these, and call it
    again."""

    made_by: tuple[Callable[..., Any], tuple[Any, ...]] | None = None

    def __reduce_ex__(self, protocol: Any) -> Any:
        return super().__reduce_ex__(protocol) if self.made_by is None else self.made_by
