"""The model error that `identify` assumes where none is given: that of the checkpoint, or on a bundled data set."""

from collections.abc import Callable
from weakref import WeakKeyDictionary

from odeform.dataset.store import bundled_datasets, open_dataset
from odeform.errors import InputError
from odeform.identification.discrepancy import Discrepancy, calibrate, stored_discrepancy
from odeform.models.base import Predictor
from odeform.models.reduced_model import ReducedModel

__all__ = ["known_discrepancy", "why_not_identifiable"]

_CALIBRATED: WeakKeyDictionary[Predictor, Discrepancy] = WeakKeyDictionary()


def why_not_identifiable(predictor: Predictor) -> str:
    """Why `identify` cannot use a predictor without being given a discrepancy; empty if it can."""
    if not isinstance(predictor, ReducedModel) or predictor.schema.objects:
        return f"expected a model of reduced coordinates of a single body, got {predictor.model}"
    if stored_discrepancy(predictor) is not None:
        return ""
    scene = predictor.schema.scene
    if scene not in bundled_datasets():
        return f"no bundled data set of scene {scene}; expected a discrepancy from `calibrate`"
    fixed, trained = open_dataset(scene).fixed, predictor.checkpoint.provenance.get("fixed")
    if trained is not None and trained != fixed:
        return (
            f"the bundled data set of {scene} has {fixed}, the model was trained with {trained}; "
            "expected a discrepancy from `calibrate`"
        )
    return ""


def known_discrepancy(predictor: Predictor, progress: Callable[[float], None] = lambda _: None) -> Discrepancy:
    """Reads the checkpoint's discrepancy, or calibrates it on the scene's bundled data set, once for each predictor.

    `progress` is called with the fraction of a calibration that is done; an exception that it raises ends it.

    Raises:
        InputError: Neither is there, or the physics of the bundled data are not those of the model's training data.
    """
    if predictor not in _CALIBRATED:
        if reason := why_not_identifiable(predictor):
            raise InputError(f"identify: {reason}")
        stored = stored_discrepancy(predictor)
        _CALIBRATED[predictor] = stored or calibrate(predictor, open_dataset(predictor.schema.scene), progress=progress)
    return _CALIBRATED[predictor]
