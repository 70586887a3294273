"""Models of other programs: registered in Python, defined in a file that `--plugin` names, or declared by a package."""

import importlib.util
import os
import sys
from importlib.metadata import entry_points
from pathlib import Path

from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.models.names import ALIASES, MODELS

__all__ = ["load_plugin", "plugged_in", "register_model", "registered"]

GROUP = "odeform.models"
"""Entry points of installed packages: a model's name, and "module:class"."""
FILES = "ODEFORM_PLUGINS"
"""Environment variable with the files of `load_plugin`, for the processes that this one starts."""

_REGISTERED: dict[str, type[Predictor]] = {}


def register_model(name: str, model: type) -> None:
    """Make a model known by its name: to `odeform.train`, `odeform.load` and the viewer of this program.

    Args:
        name: What checkpoints store; `model.model` has to be the same. Registering it again replaces the class.
        model: A subclass of `Predictor`, for instance of `odeform.NeuralModel`.

    Raises:
        InputError: A name of this package's own, another one than `model.model`, or a class that is no predictor.

    Examples:
        >>> import odeform
        >>> from odeform.models.baselines.nearest import Nearest
        >>> class Mine(Nearest):
        ...     model = "mine"
        >>> odeform.register_model("mine", Mine)
    """
    if name in MODELS or name in ALIASES:
        raise InputError(f"register_model: {name!r} is a model of ODeform; expected another name")
    if not (isinstance(model, type) and issubclass(model, Predictor)):
        raise InputError(f"register_model: expected a subclass of odeform.Predictor, got {model!r}")
    if getattr(model, "model", None) != name:
        raise InputError(f"register_model: expected {model.__name__}.model = {name!r}, which checkpoints store")
    _REGISTERED[name] = model


def registered() -> tuple[str, ...]:
    """Returns the names of the registered models, and of those that installed packages declare."""
    return (*_REGISTERED, *(entry.name for entry in entry_points(group=GROUP)))


def plugged_in(name: str) -> type[Predictor] | None:
    """The class of that name; None where neither a program nor a file nor a package has one."""
    if name not in _REGISTERED:
        for file in filter(None, os.environ.get(FILES, "").split(os.pathsep)):
            load_plugin(file)
    if name not in _REGISTERED:
        for entry in entry_points(group=GROUP, name=name):
            register_model(name, entry.load())
    return _REGISTERED.get(name)


def load_plugin(file: str | Path) -> None:
    """Run a Python file of the user's own, which registers models. Processes started later know them as well.

    `InputError` where there is no such file; errors of its code are raised as they are.
    """
    path = Path(file).resolve()
    name = f"odeform_plugin_{path.stem}"
    if getattr(sys.modules.get(name), "__file__", None) == str(path):
        return
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None or not path.is_file():
        raise InputError(f"--plugin {file}: expected a Python file, NAME.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    files = [known for known in os.environ.get(FILES, "").split(os.pathsep) if known and known != str(path)]
    os.environ[FILES] = os.pathsep.join([*files, str(path)])
