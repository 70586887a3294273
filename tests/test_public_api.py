"""Every public name has a docstring, with shapes and units where arrays pass, and its examples run."""

import doctest
import inspect
from importlib import import_module
from pathlib import Path

import pytest

import odeform

SLOW = {"calibrate", "identify", "simulate", "train"}
ROOT = Path(odeform.__file__).parent
PACKAGES = (ROOT, ROOT.parent / "odeform_viz")
ARRAYS = ("Points", "Perpoint", "Frames", "Times", "Vector", "Vectors", "Rotations", "Matrices", "Pose", "Basis",
          "Harmonics", "Faces", "Float[", "Int[", "Bool[")  # fmt: skip
"""Annotations that state a shape."""
SHAPELESS = ("Floats", "Ints", "Bools", "np.ndarray", "NDArray", "ndarray")
"""Annotations of arrays whose shape the docstring has to state."""

NAMES = [name for name in odeform.__all__ if name != "__version__"]


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow if n in SLOW else ()) for n in NAMES])
def test_examples_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    found = doctest.DocTestFinder(recurse=False).find(getattr(odeform, name), name, globs={})
    assert found[0].examples, f"odeform.{name} has no example"
    report: list[str] = []
    result = doctest.DocTestRunner().run(found[0], out=report.append)
    assert result.failed == 0, "".join(report)


def test_names_are_those_of_their_modules() -> None:
    for name in NAMES:
        public = getattr(odeform, name)
        assert public.__name__ == name
        assert name in import_module(public.__module__).__all__
    assert set(dir(odeform)) >= set(odeform.__all__)


def test_unknown_names_are_attribute_errors() -> None:
    with pytest.raises(AttributeError, match="'odeform' has no attribute 'lode'"):
        odeform.lode  # type: ignore[attr-defined]  # noqa: B018


@pytest.mark.parametrize("name", NAMES)
def test_the_face_is_documented(name: str) -> None:
    """Functions state their arguments, and what they raise."""
    public = getattr(odeform, name)
    text = inspect.getdoc(public) or ""
    assert "Examples:" in text
    if inspect.isfunction(public):
        assert "Raises:" in text
        described = text.partition("Args:")[2]
        for argument in inspect.signature(public).parameters:
            assert f"{argument}:" in described, f"odeform.{name}: argument {argument} is not described"
