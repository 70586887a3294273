"""What each part of the modal model is worth on pushed objects: `python -m odeform_figures.studies.modal_parts`.

Contact parameters that were not fitted to the object, fitted ones, these with the regression of what they leave, and
the regression of whole motions alone, which is the baseline `gp`.
"""

import argparse
from copy import copy
from typing import Any

from odeform.dataset.store import open_dataset
from odeform.evaluation.metrics import evaluate
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.models.base import Predictor
from odeform.models.modal.model import ModalModel
from odeform.models.per_object import PerObject
from odeform.models.registry import load
from odeform_figures.output import write_or_print

__all__ = ["measured", "without_parts"]

SCENE = "contact-force"
SCORES = ("rmse_pooled_mm", "rmse_pooled_95", "median_mm", "deformation_relative")


def without_parts(predictor: Predictor, fitted: bool) -> Predictor:
    """The modal model of several objects without its regression, and without its fitted contact parameters unless
    `fitted`. `TypeError` for another model."""
    if not isinstance(predictor, PerObject):
        raise TypeError(f"expected a model of several objects, got {predictor.model}")
    out = copy(predictor)
    out.parts = {name: _mechanics_of(part, fitted) for name, part in predictor.parts.items()}
    return out


def _mechanics_of(part: Predictor, fitted: bool) -> Predictor:
    if not isinstance(part, ModalModel):
        raise TypeError(f"expected a modal model, got {part.model}")
    out = copy(part) if fitted else part.with_contact_parameters(ContactParameters())
    out.residual = None
    return out


def measured() -> dict[str, Any]:
    """Mean scores of the seven objects on the test split, by what the model has."""
    dataset, modal = open_dataset(SCENE), load(SCENE)
    models = {
        "mechanics, not fitted": without_parts(modal, fitted=False),
        "mechanics, fitted": without_parts(modal, fitted=True),
        "mechanics, fitted, and regression": modal,
        "regression alone": load(f"{SCENE}/gp"),
    }
    found = {name: evaluate(model, dataset)["mean_of_objects"] for name, model in models.items()}
    return {name: {key: scores[key] for key in SCORES} for name, scores in found.items()}


def main() -> None:
    """Measure, and write or print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", metavar="FILE", help="file to write; else the figures are printed")
    args = parser.parse_args()
    write_or_print(measured(), args.json)


if __name__ == "__main__":
    main()
