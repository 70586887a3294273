"""The shape that moves: the body that was trained, or one from a file."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import viser

from odeform.errors import InputError
from odeform.types import Mesh
from odeform_viz.columns import Columns
from odeform_viz.shaping import describe_fit, shape_from

__all__ = ["ShapePanel"]

LARGEST = 256 << 20  # bytes of an upload


class ShapePanel:
    """An upload, and the way back."""

    def __init__(
        self,
        server: viser.ViserServer,
        columns: Columns,
        body: Mesh,
        changed: Callable[[], None],
        say: Callable[[str], None],
    ) -> None:
        """`changed` is called after the columns have; `say` shows a message."""
        self._columns, self._body, self._changed, self._say = columns, body, changed, say
        with server.gui.add_folder("Shape", expand_by_default=False):
            self._text = server.gui.add_markdown("The body that was trained.")
            upload = server.gui.add_upload_button(
                "Move another shape", color="gray", hint="a mesh, points or Gaussian splats, up to 200,000 points"
            )
            upload.on_upload(lambda event: self._uploaded(event.target.value))
            self._back = server.gui.add_button("Back to the trained body", color="gray", visible=False)
            self._back.on_click(lambda _: self._return())

    def _uploaded(self, file: viser.UploadedFile) -> None:
        try:
            if len(file.content) > LARGEST:
                raise InputError(f"{file.name}: expected at most {LARGEST >> 20} MB")
            # the readers take paths: the file exists only as long as it is read
            with tempfile.TemporaryDirectory(prefix="odeform-") as folder:
                path = Path(folder) / f"shape{Path(file.name).suffix}"
                path.write_bytes(file.content)
                try:
                    fit = shape_from(path, self._body)
                except InputError as error:
                    raise InputError(str(error).replace(str(path), file.name).replace(path.name, file.name)) from None
        except (InputError, OSError) as error:
            self._say(str(error))
            return
        self._columns.reshape(fit)
        self.describe(describe_fit(fit, file.name, self._body))
        self._changed()

    def describe(self, text: str) -> None:
        self._text.content = text
        self._back.visible = True

    def _return(self) -> None:
        self._columns.reshape(None)
        self._text.content = "The body that was trained."
        self._back.visible = False
        self._changed()
