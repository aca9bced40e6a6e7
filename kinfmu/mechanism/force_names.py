"""Names of the forces of a mechanism: efforts, reduced inertias, energies and reactions; those that measures read."""

from __future__ import annotations

from kinfmu.mechanism.joints import Joint
from kinfmu.mechanism.members import MechanismParts
from kinfmu.units import ForceName, Quantity, force_sizes

_INERTIAS = {("angle", "angle"): "inertia", ("length", "length"): "mass"}
_MIXED_INERTIA = "mass_moment"  # of a turning and a sliding driver

NEVER_NEGATIVE = frozenset({"reduced_inertia", "kinetic_energy", "length"})  # sums of masses times squares, distances


def force_names(mechanism: MechanismParts) -> tuple[ForceName, ...]:
    """Return the names of efforts, inertias, energies, springs and external loads; none without masses and loads."""
    has_masses = mechanism.has_masses
    if not (has_masses or mechanism.loads):
        return ()
    names = []
    for k, driver in enumerate(mechanism.drivers):
        kind = driver.quantity.kind
        effort = effort_noun(kind)
        names += [ForceName(driver.name, effort, Quantity(effort)), ForceName(driver.name, "power", Quantity("power"))]
        if has_masses:
            names.append(ForceName(driver.name, f"bias_{effort}", Quantity(effort)))
            for other in mechanism.drivers[k:]:
                noun = "reduced_inertia" if other is driver else f"reduced_inertia.{other.name}"
                quantity = Quantity(_INERTIAS.get((kind, other.quantity.kind), _MIXED_INERTIA))
                names.append(ForceName(driver.name, noun, quantity))
    energies = ("kinetic_energy", "potential_energy") if has_masses else ("potential_energy",)
    names += [ForceName("", energy, Quantity("energy")) for energy in energies]
    names += [ForceName(load.name, noun, Quantity(noun)) for load in mechanism.loads for noun in load.columns]
    return (*names, *external_names(mechanism))


def external_names(mechanism: MechanismParts) -> tuple[ForceName, ...]:
    """Return the names of the efforts of external loads, which are those of their inputs."""
    return tuple(ForceName("", name, name.quantity) for load in mechanism.loads for name in load.inputs())


def effort_noun(kind: str) -> str:
    """Return what drives an angle, a torque, or a length, a force."""
    return "torque" if kind == "angle" else "force"


def reaction_names_of(mechanism: MechanismParts) -> tuple[ForceName, ...]:
    """Return the names of all reactions of a mechanism: of each row of a joint, then shaking force and moment.

    There are none without masses and loads.
    """
    of_ground = shaking_names(mechanism)
    return (*(name for joint in mechanism.joints for name in names_of_rows(joint)), *of_ground) if of_ground else ()


def shaking_names(mechanism: MechanismParts) -> tuple[ForceName, ...]:
    """Return the names of what the mechanism exerts on the ground; none without masses and loads."""
    if not (mechanism.loads or mechanism.has_masses):
        return ()
    components = (ForceName("", f"shaking_force_{axis}", Quantity("force")) for axis in ("x", "y"))
    return (*components, ForceName("", "shaking_moment", Quantity("torque")))


def names_of_rows(joint: Joint) -> list[ForceName]:
    """Return the reactions of a joint: 'pin.force_x', 'pin.force_y'; 'slide.force', 'slide.moment'."""
    kinds, names = joint.kinds(), []
    for label, kind in zip(joint.labels, kinds, strict=True):
        noun, quantity = ("force", "force") if kind == "length" else ("moment", "torque")
        suffix = f"_{label}" if kinds.count(kind) > 1 else ""
        names.append(ForceName(joint.name, noun + suffix, Quantity(quantity)))
    return names


def measured_forces(mechanism: MechanismParts) -> dict[str, tuple[ForceName, ...]]:
    """Return the forces that measures read, by name, with the columns they are made of.

    The size of a pin's force, 'pin.force', is made of 'pin.force_x' and 'pin.force_y', and so is 'shaking_force'.
    """
    names = [*force_names(mechanism), *reaction_names_of(mechanism)]
    found: dict[str, tuple[ForceName, ...]] = {str(name): (name,) for name in names}
    return found | {str(size): components for size, components in force_sizes(names).items()}
