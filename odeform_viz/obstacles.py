"""What a body meets besides the floor. Knows no GUI."""

from odeform.loads.obstacle import Obstacle
from odeform.loads.registry import meets_twin
from odeform.motion.base import Motion
from odeform.motion.recorded import RecordedMotion
from odeform.simulation.scenes.registry import find_scene

__all__ = ["meets_something", "obstacles_of"]


def meets_something(motion: Motion | RecordedMotion) -> bool:
    """Whether a body meets more than the floor, so that a view stays with that."""
    return bool(obstacles_of(motion)) or meets_twin(motion.schema.scene)


def obstacles_of(motion: Motion | RecordedMotion) -> tuple[Obstacle, ...]:
    """The obstacles of a motion; none in scenes that are not known."""
    scene = find_scene(motion.schema.scene)
    return () if scene is None else scene.obstacles(motion.parameters)
