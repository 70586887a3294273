"""A figure that moves: one page for papers, with sliders of parameters and time, which opens without a server.

Motions on a grid of parameters are computed when it is made (`sampling`, `grid`), compressed (`table`) and written with
the body (`body`) into a page (`page`) that interpolates and draws them by itself (`figure.html`, `script`). Gaussian
splats (`splats`) are packed (`packed_splats`) and follow nodes among them (`binding`). How far what it shows is from
the model is measured on the arrays that the page holds.
"""

from odeform.figure.error import FigureError
from odeform.figure.grid import FigureColumn, interpolated
from odeform.figure.page import MOST_COLUMNS, column_bytes, figure_page
from odeform.figure.sampling import Source
from odeform.figure.sweep import Sweep, parse_sweeps
from odeform.figure.truth import truth_error

__all__ = [
    "MOST_COLUMNS",
    "FigureColumn",
    "FigureError",
    "Source",
    "Sweep",
    "column_bytes",
    "figure_page",
    "interpolated",
    "parse_sweeps",
    "truth_error",
]
