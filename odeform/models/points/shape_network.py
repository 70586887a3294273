"""One network for all shapes: encoders of the cloud, latent neural ODEs, and decoders to a rigid motion and to points.

The latent state is of the whole body, as the paper writes it (z_g of 32 numbers, z_l of 128), and not of each point, as
its released code has it (`odeform.models.points.odeform_per_point`). Points are in units of the body's own radius of
gyration, about its centre, in axes that are turned to the force.
"""

from itertools import pairwise
from typing import Any

from odeform.models.points.arithmetic import Net, Sizes
from odeform.solver.kutta import three_eighths

__all__ = ["CONDITIONS", "OFFSET", "POINT", "ShapeNet", "moved_rigidly", "point_features"]

OFFSET = 32
"""Size of the global state."""
CONDITIONS = 9
"""Numbers that describe a push and the body as a whole."""
POINT = 7
"""Numbers that describe a point: where it is, and where from the contact."""
HIDDEN = 128
TINY = 1e-12


class ShapeNet:
    """The layers and the forward pass. `width` is the size of the local latent state, 128 in the paper.

    Q are motions, M points of their clouds, P points that are asked for, F times.
    """

    def sizes(self, width: int) -> Sizes:
        """Returns the layer widths of each part of the network. Encoders have five layers, decoders three.

        The first layer of several inputs is a part for each of them, whose sum it is: what all points share is then
        computed once.
        """

        def branch(name: str, latent: int, conditions: int) -> dict[str, list[int]]:
            return {
                f"{name}.cloud": [POINT, 64],
                f"{name}.push": [CONDITIONS, 64],
                f"{name}.points": [64, HIDDEN, HIDDEN],
                f"{name}.encoder": [2 * HIDDEN + CONDITIONS, HIDDEN, latent],
                f"{name}.field": [latent + conditions + 1, *[latent] * 3, latent],
            }

        decoders = {
            "global.decoder": [OFFSET, OFFSET, OFFSET // 2, 6],
            "local.state": [width, width],
            "local.place": [POINT, width],
            "local.decoder": [width, width // 2, 3],
        }
        return branch("global", OFFSET, 0) | branch("local", width, OFFSET) | decoders

    def encode(self, net: Net, cloud: Any, areas: Any, conditions: Any) -> tuple[Any, Any]:
        """Maps clouds (Q, M, `POINT`), fractions of the surface (Q, M) and (Q, `CONDITIONS`) to the global state (Q,
        `OFFSET`) and the local one (Q, width) at rest. The order of the points does not matter."""
        states = []
        for name in ("global", "local"):
            pushed = net.layers(f"{name}.push", conditions)[..., None, :]
            seen = net.act("relu", net.layers(f"{name}.cloud", cloud) + pushed)
            found = net.act("relu", net.layers(f"{name}.points", seen, "relu"))
            pooled = net.join([(areas[..., None] * found).sum(-2), net.largest(found), conditions])
            states.append(net.layers(f"{name}.encoder", pooled, "relu"))
        return states[0], states[1]

    def states(self, net: Net, first: tuple[Any, Any], times: Any) -> tuple[Any, Any]:
        """States (F, Q, latent) at F times in windows, from those at the first, by Kutta's 3/8 rule between times."""
        whole, local = first
        return self._roll_out(net, "global", whole, [], times), self._roll_out(net, "local", local, [whole], times)

    def decode(self, net: Net, states: tuple[Any, Any], points: Any) -> tuple[Any, Any]:
        """Maps states (F, Q, latent) and points (Q, P, `POINT`) to rigid motions (F, Q, 6), three numbers that shift
        and three that turn, and to deformations (F, Q, P, 3). Both are zero at the first time."""
        whole, local = states
        rigid = net.layers("global.decoder", whole, "relu")
        seen = net.layers("local.state", local)[..., None, :] + net.layers("local.place", points)
        deformed = net.layers("local.decoder", net.act("relu", seen), "relu")
        return rigid - rigid[:1], deformed - deformed[:1]

    def _roll_out(self, net: Net, name: str, state: Any, conditions: list[Any], times: Any) -> Any:
        def field(state: Any, time: Any) -> Any:
            return net.layers(f"{name}.field", net.join([state, *conditions, 0.0 * state[..., :1] + time]), "tanh")

        out = [state]
        for begin, end in pairwise(times):
            state = three_eighths(field, state, begin, end)
            out.append(state)
        return net.stack(out)


def point_features(net: Net, x: Any, contact: Any) -> Any:
    """Maps points (..., P, 3) and contacts (..., 3) in radii of gyration to (..., P, `POINT`)."""
    away = x - contact[..., None, :]
    return net.join([x, away, ((away**2).sum(-1) + TINY)[..., None] ** 0.5])


def moved_rigidly(net: Net, x: Any, shift: Any, turn: Any) -> Any:
    """Points (..., 3) after a rotation by the vector `turn` (..., 3) in radians about the origin, and a `shift`."""
    angle = ((turn**2).sum(-1) + TINY)[..., None] ** 0.5
    once = _cross(net, turn, x)
    twice = _cross(net, turn, once)
    half = net.act("sin", 0.5 * angle) / angle
    return x + net.act("sin", angle) / angle * once + 2.0 * half**2 * twice + shift


def _cross(net: Net, a: Any, b: Any) -> Any:
    (x, y, z), (u, v, w) = ([vector[..., i : i + 1] for i in range(3)] for vector in (a, b))
    return net.join([y * w - z * v, z * u - x * w, x * v - y * u])
