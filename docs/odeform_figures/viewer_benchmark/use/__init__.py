"""Scripts what people do with the page: `SCRIPTS` by the control that each needs. `Missed` if one fails."""

from collections.abc import Callable

from odeform_figures.viewer_benchmark.use.columns import compare
from odeform_figures.viewer_benchmark.use.downloads import export, take_pictures
from odeform_figures.viewer_benchmark.use.faults import fill_disk, kill_fit, kill_simulator, set_clock
from odeform_figures.viewer_benchmark.use.fits import fit
from odeform_figures.viewer_benchmark.use.recordings import record
from odeform_figures.viewer_benchmark.use.shapes import load_shapes
from odeform_figures.viewer_benchmark.use.simulations import simulate
from odeform_figures.viewer_benchmark.use.states import save_and_restore
from odeform_figures.viewer_benchmark.use.visits import come_and_go
from odeform_figures.viewer_benchmark.visitors import Visitors

__all__ = ["SCRIPTS"]

SCRIPTS: tuple[tuple[Callable[[Visitors], None], str], ...] = (
    (compare, "Pin these parameters"),
    (export, "Download"),
    (take_pictures, "Film (.webp)"),
    (fit, "Fit to the truth"),
    (record, "Start recording"),
    (load_shapes, "Load a shape..."),
    (simulate, "Simulate this"),
    (save_and_restore, "Save state"),
    (come_and_go, "time (s)"),
    (kill_simulator, "Simulate this"),
    (kill_fit, "Fit to the truth"),
    (fill_disk, "Start recording"),
    (set_clock, "Start recording"),
)
