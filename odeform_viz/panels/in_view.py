"""Marks parts of the panel that the page shows over the scene instead, where they are always in view."""

__all__ = ["in_view"]


def in_view(place: str, content: str) -> str:
    """HTML for a place of `browser/view.js`: "caption", "trust", "shape", "scale" or "timeline"."""
    return f'<div data-odeform-view="{place}">{content}</div>'
