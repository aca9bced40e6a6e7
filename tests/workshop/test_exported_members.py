"""Public names: all are in `__all__`, exist and are documented."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections import Counter
from types import ModuleType

import pytest

import kinfmu

PACKAGES = ["kinfmu", *(m.name for m in pkgutil.walk_packages(kinfmu.__path__, "kinfmu.") if m.ispkg)]
MODULES = [m.name for m in pkgutil.walk_packages(kinfmu.__path__, "kinfmu.")]


def public_members(module: ModuleType) -> set[str]:
    """Names without underscore of kinfmu's own classes, functions and constants that a package holds."""
    return {
        name
        for name, value in vars(module).items()
        if not name.startswith("_")
        and not inspect.ismodule(value)
        and (getattr(value, "__module__", "").startswith("kinfmu") or name.isupper())
        and name != "TYPE_CHECKING"
    }


@pytest.mark.parametrize("name", PACKAGES)
def test_every_public_name_of_a_package_is_in_all(name: str) -> None:
    package = importlib.import_module(name)
    exported = getattr(package, "__all__", [])
    assert len(set(exported)) == len(exported)
    assert public_members(package) <= set(exported)


@pytest.mark.parametrize("name", PACKAGES)
def test_every_exported_name_exists_and_is_documented(name: str) -> None:
    package = importlib.import_module(name)
    for member in getattr(package, "__all__", []):
        value = getattr(package, member)
        if inspect.isclass(value) or inspect.isfunction(value):
            text = value.__doc__ or ""
            assert text, f"{name}.{member} has no docstring"
            assert not text.startswith(f"{value.__name__}("), f"{name}.{member} has only a generated docstring"


@pytest.mark.parametrize("name", MODULES)
@pytest.mark.few(183)
def test_every_module_or_the_class_it_is_named_after_is_documented(name: str) -> None:
    module = importlib.import_module(name)
    namesake = name.rpartition(".")[2].replace("_", "")
    classes = [value for key, value in vars(module).items() if inspect.isclass(value) and key.lower() == namesake]
    assert module.__doc__ or any(value.__doc__ for value in classes)


def test_no_two_classes_have_one_name() -> None:
    modules = {name: vars(importlib.import_module(name)) for name in MODULES}
    names = [
        value.__name__
        for name, members in modules.items()
        for value in members.values()
        if inspect.isclass(value) and value.__module__ == name and not value.__name__.startswith("_")
    ]
    twice = {name for name, count in Counter(names).items() if count > 1}
    assert not twice


def test_the_api_of_the_contract_is_exported() -> None:
    contract = {"load", "save", "check", "solve", "build", "simulate", "Mechanism", "Body", "Point", "VERSION"}
    assert contract <= set(kinfmu.__all__)
    assert contract <= set(dir(kinfmu))
    assert {"write_mcap", "write_rrd", "read"} <= set(kinfmu.log.__all__) <= set(dir(kinfmu.log))


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'kinfmu' has no attribute 'nothing'"):
        _ = kinfmu.nothing
