"""Every public name has a docstring, with shapes and units where arrays pass, and its examples run."""

import doctest
import inspect
import re
from collections.abc import Iterator
from functools import cached_property
from importlib import import_module
from pathlib import Path

import pytest

import odeform

ACCESSORS = (property, cached_property, classmethod, staticmethod)
SLOW = {"calibrate", "fit", "identify", "simulate", "train"}
ROOT = Path(odeform.__file__).parent
PACKAGES = (ROOT, ROOT.parent / "odeform_viz", ROOT.parent / "docs" / "odeform_figures")
COMMANDS = ("odeform.cli.", "odeform_figures.commands.")
"""Modules of commands: `odeform.cli.entry.Command` documents their functions."""

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


def public_objects() -> Iterator[tuple[str, object]]:
    """Every class and function in the `__all__` of a module, and the public methods and properties of classes."""
    for package in PACKAGES:
        for path in sorted(package.rglob("*.py")):
            name = ".".join(path.relative_to(package.parent).with_suffix("").parts).removesuffix(".__init__")
            if path.name == "__main__.py" or name == "odeform" or name.startswith(COMMANDS):
                continue
            module = import_module(name)
            for public in getattr(module, "__all__", ()):
                value = getattr(module, public)
                if inspect.isfunction(value) or inspect.isclass(value):
                    yield f"{name}.{public}", value
                if inspect.isclass(value):
                    methods = {k: m for k, m in vars(value).items() if not k.startswith("_")}
                    for key, member in methods.items():
                        if key in inspect.get_annotations(value):
                            continue  # a field whose default is a function
                        if inspect.isfunction(member) or isinstance(member, ACCESSORS):
                            yield f"{name}.{public}.{key}", inspect.getattr_static(value, key)


def documentation(where: str, value: object) -> str:
    """The docstring, that of the same method of a base class included; not the signature that dataclasses insert."""
    text = inspect.getdoc(value) or ""
    if not text and not inspect.isclass(value):
        module, _, rest = where.rpartition(".")
        owner = getattr(import_module(module.rpartition(".")[0]), module.rpartition(".")[2], None)
        bases = inspect.getmro(owner)[1:] if inspect.isclass(owner) else ()
        text = next((d for b in bases if rest in vars(b) and (d := inspect.getdoc(vars(b)[rest]))), "")
    generated = inspect.isclass(value) and text.startswith(f"{value.__name__}(")
    return "" if generated else text


def states_shape(value: object, text: str) -> bool:
    """Whether arrays without a shape in their annotation have one in the docstring, as (N, 3), (T,) or (...)."""
    function = next((f for key in ("fget", "func", "__func__") if (f := getattr(value, key, None))), value)
    annotations = str(inspect.signature(function)) if inspect.isfunction(function) else ""
    bare = re.search(r"numpy\.floating|numpy\.integer|numpy\.bool", annotations)
    return not bare or bool(re.search(r"\([^()]*[A-Z0-9.][^()]*,[^()]*\)|\(\.\.\.|scalar", text))


def test_everything_public_is_documented() -> None:
    missing, shapeless = set(), set()
    for where, value in public_objects():
        text = documentation(where, value)
        if not text:
            missing.add(where)
        elif not states_shape(value, text):
            shapeless.add(where)
    assert sorted(missing) == []
    assert sorted(shapeless) == []
