"""The models that move each point by itself, by name."""

from odeform.models.names import MODELS
from odeform.models.points.point_model import PointModel
from odeform.models.registry import model_class

CLASSES = {name: model_class(name) for name in MODELS}
POINT_MODELS = {name: model for name, model in CLASSES.items() if issubclass(model, PointModel)}
