"""The light of the scene: a key that casts soft shadows, a fill from the sky and the floor, and a rim from behind."""

import math

import numpy as np
import viser

from odeform.types import Floats
from odeform_viz.rendering.framing import Axes, Framing

__all__ = ["Lights", "towards_key"]

ELEVATION, ASIDE = math.radians(52.0), math.radians(42.0)  # of the key above the floor, and left of the camera
KEY, FILL, RIM = 2.8, 2.5, 0.9  # intensities
SKY, GROUND = (255, 255, 255), (196, 186, 176)
AWAY = 12.0  # distance of the key in sizes of what it lights: its rays are nearly parallel
ROOM, EVERYTHING = 1.5, 8.0  # sizes of what is lit: bodies on a floor of their own, and within a captured scene


def towards_key(axes: Axes) -> Floats:
    """(3,) from the bodies to the key light: in front of them, so that shadows fall behind, off the floors below."""
    camera = math.atan2(axes.direction[1], axes.direction[0])
    azimuth = camera - ASIDE
    return np.array(
        [
            math.cos(ELEVATION) * math.cos(azimuth),
            math.cos(ELEVATION) * math.sin(azimuth),
            math.sin(ELEVATION),
        ]
    )


class Lights:
    """Lights that follow the framing; they replace viser's own."""

    def __init__(self, server: viser.ViserServer) -> None:
        scene = server.scene
        scene.configure_default_lights(enabled=False)
        scene.configure_environment_map(None)
        scene.add_light_hemisphere("/light/fill", sky_color=SKY, ground_color=GROUND, intensity=FILL)
        self._rim = scene.add_light_directional("/light/rim", intensity=RIM)
        self._key = scene.add_light_spot("/light/key", intensity=KEY, decay=0.0, penumbra=1.0, cast_shadow=True)

    def aim(self, framing: Framing, everywhere: bool) -> None:
        """Light what is framed, or a scene around it as well."""
        towards, size = towards_key(framing.axes), float(np.hypot(*framing.span))
        lit = (EVERYTHING if everywhere else ROOM) * size
        self._key.position = framing.middle + AWAY * size * towards
        self._key.direction = tuple(-towards)
        self._key.angle = math.atan(0.5 * lit / (AWAY * size))
        self._rim.position = tuple(framing.axes.right - framing.axes.direction + np.array([0.0, 0.0, 1.0]))
