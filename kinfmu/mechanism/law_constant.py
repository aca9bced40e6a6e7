"""Constants of drivers' laws, by the names under which they are set."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from kinfmu.drivers import Driver
from kinfmu.laws.law import Path
from kinfmu.mechanism.members import NumberPath
from kinfmu.units import Quantity


class LawConstant(NamedTuple):
    """A constant of a law of motion, settable under its name `<driver>.<key>`."""

    name: str
    value: float
    quantity: Quantity
    is_positive: bool = False  # other values are refused


def law_constants(drivers: Sequence[Driver], computed: Collection[NumberPath]) -> Iterator[LawConstant]:
    """The constants of all drivers' laws in file order, without those that an expression gives (`computed`)."""
    for driver in drivers:
        for key, (value, said) in driver.law.constants().items():
            if ("drivers", driver.name, "law", key) not in computed:
                quantity = said.quantity(*driver.law_kinds)
                yield LawConstant(f"{driver.name}.{key}", float(value), quantity, said.is_positive)


def with_law_constants(drivers: Sequence[Driver], values: Mapping[str, float]) -> tuple[Driver, ...]:
    """The drivers with other values of some of those constants."""

    def changed(driver: Driver) -> Driver:
        named = {key: f"{driver.name}.{key}" for key in driver.law.constants()}
        new: dict[Path, float] = {(key,): values[name] for key, name in named.items() if name in values}
        return replace(driver, law=driver.law.with_numbers(new)) if new else driver  # type: ignore[type-var]

    return tuple(map(changed, drivers))
