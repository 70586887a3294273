"""ODeform: learned continuous motion of soft bodies.

Load a model, predict a motion, and evaluate it at any time:

    import odeform

    predictor = odeform.load("kick")
    motion = predictor.solve(parameters={"mass": 0.6, "force": 140.0})
    motion.vertices(0.02)  # (N, 3) metres

Lengths are metres, times seconds, masses kilograms, forces newtons and angles radians, unless a name says otherwise.
Names are imported when they are first used, so that `import odeform` takes a few milliseconds.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from odeform.dataset.in_memory import dataset_from_arrays
    from odeform.dataset.index import Dataset
    from odeform.dataset.store import open_dataset
    from odeform.errors import InputError
    from odeform.evaluation.metrics import evaluate
    from odeform.formats.reading import read_geometry
    from odeform.formats.writing import write_motion, write_shape
    from odeform.identification.discrepancy import calibrate
    from odeform.identification.identify import identify
    from odeform.identification.observation import Observation
    from odeform.models.base import Predictor
    from odeform.models.neural_model import NeuralModel
    from odeform.models.plugins import register_model
    from odeform.models.registry import load
    from odeform.motion.base import Motion
    from odeform.schema import Parameter, Schema
    from odeform.simulation.runner import simulate
    from odeform.solver.integrate import SolverSettings
    from odeform.surroundings import Surroundings
    from odeform.training.train import fit, train
    from odeform.types import GaussianSplats, Mesh, MotionSequence, PointCloud

    __version__: str

__all__ = [
    "Dataset",
    "GaussianSplats",
    "InputError",
    "Mesh",
    "Motion",
    "MotionSequence",
    "NeuralModel",
    "Observation",
    "Parameter",
    "PointCloud",
    "Predictor",
    "Schema",
    "SolverSettings",
    "Surroundings",
    "__version__",
    "calibrate",
    "dataset_from_arrays",
    "evaluate",
    "fit",
    "identify",
    "load",
    "open_dataset",
    "read_geometry",
    "register_model",
    "simulate",
    "train",
    "write_motion",
    "write_shape",
]

_MODULES = {
    "Dataset": "dataset.index",
    "GaussianSplats": "types",
    "InputError": "errors",
    "Mesh": "types",
    "Motion": "motion.base",
    "MotionSequence": "types",
    "NeuralModel": "models.neural_model",
    "Observation": "identification.observation",
    "Parameter": "schema",
    "PointCloud": "types",
    "Predictor": "models.base",
    "Schema": "schema",
    "SolverSettings": "solver.integrate",
    "Surroundings": "surroundings",
    "calibrate": "identification.discrepancy",
    "dataset_from_arrays": "dataset.in_memory",
    "evaluate": "evaluation.metrics",
    "fit": "training.train",
    "identify": "identification.identify",
    "load": "models.registry",
    "open_dataset": "dataset.store",
    "read_geometry": "formats.reading",
    "register_model": "models.plugins",
    "simulate": "simulation.runner",
    "train": "training.train",
    "write_motion": "formats.writing",
    "write_shape": "formats.writing",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        value = version("odeform")
    elif name in _MODULES:
        value = getattr(import_module(f"odeform.{_MODULES[name]}"), name)
    else:
        raise AttributeError(f"module 'odeform' has no attribute {name!r}")
    globals()[name] = value  # found directly from now on
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
