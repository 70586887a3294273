"""Scene nodes whose names are used again."""

import viser

__all__ = ["add_place"]

ELSEWHERE, TURNED = (0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0)
ORIGIN, UPRIGHT = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)


def add_place(server: viser.ViserServer, name: str) -> viser.FrameHandle:
    """An empty node without a shift and a turn, of which browsers are told.

    viser does not send a pose that a new node has anyway. A node that is removed and made again between two renderings
    would have the pose of the former one in the browser.
    """
    node = server.scene.add_frame(name, show_axes=False, position=ELSEWHERE, wxyz=TURNED)
    node.position, node.wxyz = ORIGIN, UPRIGHT
    return node
