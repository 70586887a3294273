"""Describes what an importer finds: sequences made elsewhere, which are read one at a time."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from odeform.types import Faces, Frames

__all__ = ["Source", "SourceSequence"]


@dataclass(frozen=True)
class SourceSequence:
    """One sequence, not read yet."""

    name: str
    parameters: Mapping[str, float]
    frames: int
    read: Callable[[], tuple[Frames, Faces]]
    """Returns vertices (T, N, 3) in metres and faces (F, 3). Raises `InputError` for damaged files."""
    split: str = ""
    """"train", "val" or "test"; empty if the source has no splits."""
    metric: bool = False
    """Whether its files say their unit, so that no other is assumed."""


@dataclass(frozen=True)
class Source:
    """All sequences of a folder."""

    scene: str
    rate: float
    """Frames per second, Hz."""
    sequences: tuple[SourceSequence, ...]
    units: Mapping[str, str]
    """Unit of each parameter, by name; missing if unknown."""
    log_scaled: frozenset[str] = frozenset()
    """Parameters of which ratios matter rather than differences."""
    notes: tuple[str, ...] = ()
    provenance: dict[str, Any] = field(default_factory=dict)
    doubts: tuple[str, ...] = ()
    """Notes, for the user to check, say what was assumed or left out."""
