"""Names in a recording: its format version, timelines and entities. Files of users have them: never rename one."""

__all__ = [
    "END",
    "FORMAT",
    "FRAME",
    "HEADER",
    "OLD_REQUEST",
    "PROVENANCE",
    "REQUEST",
    "REST",
    "STILL",
    "TIME",
    "WORLD",
]

FORMAT = 1

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
WORLD = "world"
STILL = f"{WORLD}/still"  # the part of a captured scene that does not move
