"""Docstrings of what users call list their arguments: an API reference is made from them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from typing import Any

import pytest

import kinfmu
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.joints import Joint
from kinfmu.mechanism.laws import Law
from kinfmu.mechanism.loads import Load
from kinfmu.mechanism.quantities import PoseQuantity

PARTS = (Driver, Joint, Law, Load, PoseQuantity)  # users write them; the equations call their methods
EXPORTED = [getattr(kinfmu, name) for name in kinfmu.__all__]
CLASSES = [one for one in EXPORTED if inspect.isclass(one)]
CALLED = [one for one in CLASSES if not issubclass(one, PARTS)]


def methods(cls: type) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Public methods of a class and of its parents in kinfmu."""
    for parent in cls.__mro__:
        if parent.__module__.split(".")[0] == "kinfmu":
            for name, member in vars(parent).items():
                function = getattr(member, "__func__", member)
                if not name.startswith("_") and inspect.isfunction(function):
                    yield f"{parent.__name__}.{name}", function


FUNCTIONS = {f"{one.__module__}.{one.__name__}": one for one in EXPORTED if inspect.isfunction(one)}
METHODS = {name: function for cls in CALLED for name, function in methods(cls)}


@pytest.mark.parametrize(("name", "function"), (FUNCTIONS | METHODS).items(), ids=(FUNCTIONS | METHODS).keys())
def test_a_public_function_with_arguments_describes_each(name: str, function: Callable[..., Any]) -> None:
    arguments = [one for one in inspect.signature(function).parameters if one not in ("self", "cls")]
    text = inspect.getdoc(function) or ""
    described = text.partition("Args:\n")[2].partition("\n\n")[0].replace("*", "")
    missing = [one for one in arguments if f"    {one}:" not in described and f", {one}" not in described]
    assert missing == [], name


def test_the_classes_looked_at_are_those_that_users_call() -> None:
    assert {"Run", "Model", "Mechanism", "Sensitivities", "FitProblem", "Sink"} <= {one.__name__ for one in CALLED}
