"""Names in a recording: its format version, timelines and entities. Files of users have them: never rename one."""

__all__ = [
    "COEFFICIENTS",
    "END",
    "FLOOR",
    "FORMAT",
    "FRAME",
    "HEADER",
    "MODES",
    "OLD_FORMAT",
    "OLD_REQUEST",
    "POINTS",
    "PROVENANCE",
    "REQUEST",
    "REST",
    "STILL",
    "TIME",
    "WORLD",
]

FORMAT = 2
OLD_FORMAT = 1  # the points of each frame are those of its body in WORLD

# timelines
FRAME = "shown"  # number of the frame, counted from 0
TIME = "motion_time"  # seconds of the motion

# entities; a column is the path column_KEY/form_N below them, N counting the shapes that it has had
HEADER = "recording"  # format and versions
REQUEST = "request"  # of each frame: what it takes to compute the frame again
OLD_REQUEST = "wish"  # its name in older recordings
END = "end"  # the number of frames; only a recording that was closed has it
PROVENANCE = "provenance"
REST = "rest"  # points before any deformation
MODES = "modes"  # displacements, of which the points of a frame are a sum, in the order in which they were logged
COEFFICIENTS = "coefficients"  # the factors of the first modes, one each
POINTS = "points"  # the points of a frame that is no sum of modes
WORLD = "world"  # what Rerun shows
FLOOR = f"{WORLD}/floor"
STILL = f"{WORLD}/still"  # the part of a captured scene that does not move
