"""The viewer. In a notebook: `odeform_viz.show(predictor)` shows its page, `embed` a motion, `figure` one with
sliders.

Names are imported when they are first used, so that the command starts at once.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from odeform_viz.notebook import embed, figure, show

__all__ = ["embed", "figure", "show"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'odeform_viz' has no attribute {name!r}")
    from odeform_viz import notebook

    return getattr(notebook, name)
