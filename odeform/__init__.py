"""ODeform: learned continuous motion of soft bodies."""

from importlib.metadata import version

from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.models.base import Predictor
from odeform.models.registry import load

__all__ = ["InputError", "Predictor", "__version__", "load", "read_geometry"]

__version__ = version("odeform")
