"""A stored sequence as a motion, with the mass and the stiffness that its object has by itself."""

from dataclasses import replace

from odeform.dataset.recorded import read_recorded
from odeform.motion.recorded import RecordedMotion
from odeform.schema import OBJECT
from odeform.simulation.contacts import MASS, YOUNG
from odeform.simulation.objects.catalog import OBJECTS, get_object

__all__ = ["read_truth"]


def read_truth(origin: str) -> RecordedMotion:
    """The sequence DATASET/NAME, as `read_recorded` has it.

    Data that do not vary the mass and the stiffness of an object keep its own: they belong to what is known of the
    motion, which another mass or stiffness does not have.
    """
    truth = read_recorded(origin)
    name = truth.parameters.get(OBJECT)
    if name not in OBJECTS:
        return truth
    item = get_object(str(name))
    return replace(truth, fixed={MASS: item.mass, YOUNG: 1e-3 * item.material.young, **truth.fixed})
