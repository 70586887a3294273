"""The folder that confines the page: paths that come from a browser lead nowhere else."""

from collections.abc import Container, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from odeform.checkpoint import bundled_checkpoints
from odeform.dataset.store import bundled_datasets
from odeform.errors import InputError
from odeform.formats.bundled import bundled_shapes
from odeform_viz.columns import Column
from odeform_viz.recording.provenance import origin_of
from odeform_viz.state import PageState

__all__ = ["Workspace"]


@dataclass(frozen=True)
class Workspace:
    """Confines where the page may read and write. Bundled files and those of the command line may be read too."""

    root: Path = Path()
    opened: frozenset[Path] = frozenset()

    @classmethod
    def of(cls, root: str | Path, columns: Iterable[Column]) -> "Workspace":
        """`columns` are those of the command line. `InputError` if `root` is not a folder."""
        if not Path(root).is_dir():
            raise InputError(f"--workspace {root}: no such folder")
        columns = list(columns)
        models = [origin_of(column) for column in columns if not column.truth]
        datasets = [origin_of(column).rpartition("/")[0] for column in columns if column.truth]
        shapes = [column.fit.origin for column in columns if column.fit]
        return cls(Path(root), frozenset(Path(name).resolve() for name in (*models, *datasets, *shapes) if name))

    def inside(self, name: str) -> Path:
        """Returns a path of the page, relative to the folder. `InputError` if it leads out of it, through links too."""
        path = self.root / name
        try:
            found = path.resolve()
        except (OSError, ValueError, RuntimeError) as error:  # a null character, or links in a circle
            raise InputError(f"{name[:100]!r}: not a path: {error}") from None
        if not found.is_relative_to(self.root.resolve()) and found not in self.opened:
            raise InputError(f"{name[:100]}: outside of the folder {self.root.resolve()}, which confines the page")
        return path

    def confined(self, state: PageState) -> PageState:
        """Returns the same state, whose files are bundled or inside. `InputError` for others."""
        columns = tuple({**column, "origin": self._column(column)} for column in state.columns)
        shape = state.shape and {**state.shape, "origin": self._file(str(state.shape["origin"]), bundled_shapes())}
        return replace(state, columns=columns, shape=shape)

    def _column(self, column: object) -> str:
        assert isinstance(column, dict)
        origin = column["origin"]
        if column["truth"]:
            dataset, _, name = origin.rpartition("/")
            return f"{self._file(dataset, bundled_datasets())}/{name}"
        known = bundled_checkpoints()
        return origin if f"{origin}/odeform" in known else self._file(origin, known)

    def _file(self, origin: str, bundled: Container[str]) -> str:
        return origin if origin in bundled else str(self.inside(origin))
