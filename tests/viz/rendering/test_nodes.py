"""A node of a name that was used before."""

import viser
from viser._messages import SetOrientationMessage, SetPositionMessage

from odeform_viz.rendering.nodes import add_place


def test_a_node_that_is_made_again_is_not_where_the_former_one_was(server: viser.ViserServer) -> None:
    former = add_place(server, "/body")
    former.position, former.wxyz = (0.3, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0)
    former.remove()
    add_place(server, "/body")
    buffer = server.scene._websock_interface.get_message_buffer()
    sent = [m for m in buffer.message_from_id.values() if getattr(m, "name", "") == "/body"]
    assert [m.position for m in sent if isinstance(m, SetPositionMessage)] == [(0.0, 0.0, 0.0)]
    assert [m.wxyz for m in sent if isinstance(m, SetOrientationMessage)] == [(1.0, 0.0, 0.0, 0.0)]
