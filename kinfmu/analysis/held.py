"""One driver alone: the mechanism in which the other drivers hold their start values."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

from kinfmu.arrays import FloatArray
from kinfmu.mechanism import Mechanism, Start
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.joints import Held
from kinfmu.mechanism.quantities import CoordinateOf, PoseQuantity
from kinfmu.mechanism.quantities.arithmetic import decimal_sum
from kinfmu.plan import SolvePlan, compile_plan
from kinfmu.plan.origin import in_world


@dataclass(frozen=True)
class HeldDriver(Held):
    """The quantity of a driver, held at a value.

        Phi = quantity - value, or the row that the quantity defines in its place        (1 row)

    Only `check` uses it: the range of one driver is found with the others at their start values.
    """

    type: ClassVar[str] = "held_driver"
    labels: ClassVar[tuple[str, ...]] = ("value",)

    name: str
    driver: Driver = field(metadata={"internal": True})
    value: float = field(metadata={"internal": True})

    def moved(self, dx: float, dy: float) -> HeldDriver:
        quantity = self.driver.measured()
        if not isinstance(quantity, CoordinateOf):
            return self
        return replace(self, value=decimal_sum(self.value, dx if quantity.axis == "x" else dy))

    def measured(self) -> tuple[PoseQuantity, float]:
        return self.driver.measured(), self.value


def alone(plan: SolvePlan, number: int) -> SolvePlan:
    """Return the plan of one driver alone, by its number, with all coordinates as outputs.

    The other drivers keep their values in the plan's anchor, and it starts from the anchor's pose. Returns the plan
    itself if there is nothing to hold.
    """
    mechanism = plan.mechanism
    if len(mechanism.drivers) == 1 and isinstance(mechanism.coordinates, str):
        return plan
    taken = {joint.name for joint in mechanism.joints}
    held = []
    for k, driver in enumerate(mechanism.drivers):
        if k != number:
            name = driver.name
            while name in taken:
                name += "_held"
            taken.add(name)
            held.append(HeldDriver(name, driver, float(plan.anchor.u[k])))
    return compile_plan(
        replace(
            started(mechanism, in_world(plan.origin, plan.anchor.q)),
            joints=(*mechanism.joints, *held),
            drivers=(mechanism.drivers[number],),
            coordinates="all",
            points={},
            measures=(),  # they may read forces of the other drivers
        )
    )


def started(mechanism: Mechanism, pose: FloatArray) -> Mechanism:
    """Return the mechanism with this pose of all coordinates, in the world, as its start."""
    poses = iter(pose.reshape(-1, 3).tolist())
    bodies = [body if body.is_ground else replace(body, start=Start(*next(poses))) for body in mechanism.bodies]
    return replace(mechanism, bodies=tuple(bodies))
