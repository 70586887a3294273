"""The model error that `identify` assumes where none is given: that on the bundled data set of the scene."""

from weakref import WeakKeyDictionary

from odeform.dataset.store import bundled_datasets, open_dataset
from odeform.errors import InputError
from odeform.identification.discrepancy import Discrepancy, calibrate
from odeform.models.base import Predictor

__all__ = ["bundled_discrepancy"]

_CALIBRATED: WeakKeyDictionary[Predictor, Discrepancy] = WeakKeyDictionary()


def bundled_discrepancy(predictor: Predictor) -> Discrepancy:
    """`calibrate` on the bundled data set of the predictor's scene, once for each predictor.

    Raises:
        InputError: No such data set is bundled, or its physics are not those of the model's training data.
    """
    if predictor not in _CALIBRATED:
        scene = predictor.schema.scene
        if scene not in bundled_datasets():
            raise InputError(f"identify: no bundled data set of scene {scene}; expected a discrepancy from `calibrate`")
        dataset = open_dataset(scene)
        trained = predictor.checkpoint.provenance.get("fixed")
        if trained is not None and trained != dataset.fixed:
            raise InputError(
                f"identify: the bundled data set of {scene} has {dataset.fixed}, the model was trained with {trained}; "
                "expected a discrepancy from `calibrate`"
            )
        _CALIBRATED[predictor] = calibrate(predictor, dataset)
    return _CALIBRATED[predictor]
