"""What all joints, drivers, loads and laws share: types, frozen dataclasses, exports, equations, keys."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest

import kinfmu
from kinfmu.mechanism import drivers, joints, laws, loads
from kinfmu.mechanism.drivers import DRIVERS
from kinfmu.mechanism.joints import JOINTS
from kinfmu.mechanism.laws import LAWS
from kinfmu.mechanism.loads import LOADS
from kinfmu.mechanism.toml_document import table_keys

EQUATIONS = (
    (joints, JOINTS, "Phi = "),
    (drivers, DRIVERS, "Phi = "),
    (loads, LOADS, "\n        e = "),
    (laws, LAWS, "u = "),
)
MEMBERS = [(cls, package, equation) for package, classes, equation in EQUATIONS for cls in classes]


@pytest.mark.parametrize(
    "classes", [classes for _, classes, _ in EQUATIONS], ids=["joints", "drivers", "loads", "laws"]
)
def test_types_are_all_different(classes: tuple[Any, ...]) -> None:
    assert len({cls.type for cls in classes}) == len(classes)


@pytest.mark.parametrize(("cls", "package", "equation"), MEMBERS, ids=[cls.__name__ for cls, *_ in MEMBERS])
def test_a_member_is_a_frozen_dataclass_that_is_exported_and_shows_its_equation(
    cls: Any, package: Any, equation: str
) -> None:
    assert dataclasses.is_dataclass(cls)
    assert cls.__dataclass_params__.frozen
    assert cls.__name__ in package.__all__
    assert package is joints or cls.__name__ in kinfmu.__all__  # a joint may be added without it
    assert equation in (cls.__doc__ or "")
    if package is not laws:
        assert dataclasses.fields(cls)[0].name == "name"
    if package is joints:
        assert len(set(cls.labels)) == len(cls.labels) > 0


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.type)
def test_no_key_of_a_law_is_a_key_of_a_member_that_may_have_it(law: Any) -> None:
    theirs = {key for member in (*JOINTS, *DRIVERS, *LOADS) for key in table_keys(member) if key != "law"}
    assert not set(table_keys(law)) & (theirs | {"type", "law", "name"})
