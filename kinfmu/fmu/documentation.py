"""documentation/index.html of an FMU: picture, drivers with ranges and laws, wiring, limits, accuracy, variables."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from html import escape
from types import MappingProxyType

from kinfmu.analysis.singular import DriverRange
from kinfmu.fmu.interface import Interface, Variable
from kinfmu.fmu.reference import FOLDER, ReferenceResults
from kinfmu.fmu.slave.layout import UNKNOWN_ERROR
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.number import DisplayUnit, given_unit
from kinfmu.plan import SolvePlan
from kinfmu.solver.python.pose import Status
from kinfmu.units import Quantity, unit_of

_PAGE = """<!DOCTYPE html>
<html lang="en" class="kinfmu">
<head><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{title}</title>
<style>:root {{ color-scheme: light dark }}
body {{ font-family: sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em }}
table {{ display: block; overflow-x: auto }} td, th {{ padding: 0.1em 1em 0.1em 0; text-align: left;
vertical-align: top }} svg {{ display: block; max-width: 40em; margin: 1em auto }}</style></head>
<body>
<h1>{title}</h1>
<p>Kinematics of a planar mechanism{forces}, solved to round-off. Unit of length: {unit}; angles in rad.</p>
{picture}
<h2>Drivers</h2>
{drivers}
<p>{driven}</p>
<h2>Wiring</h2>
{wiring}
{port}
<h2>When a pose cannot be reached</h2>
<p><code>solver.status</code> reports it, outputs keep the last good values, <code>solver.message</code> states driver,
value and limit, and the next step returns Discard (in native FMUs also a get of positions, rates and accelerations).
The host may set other inputs and continue. Status: {statuses}. If your host reads no enumerations, record
<code>solver.ok</code>.</p>
<h2>Accuracy</h2>
<p>Positions, rates and accelerations are exact to round-off at regular poses, also at change points, which are bridged
(status 2). <code>solver.error_q</code>, <code>solver.error_qd</code> and <code>solver.error_qdd</code> estimate the
errors of each sample, those of estimated speeds and accelerations included. Where there is no estimate
(<code>solver.error_qd</code> at the first two samples of estimated speeds, <code>solver.error_qdd</code> at the first
three) they are {unknown:g}.</p>
<h2>Checking your host</h2>
{reference}
<h2>Variables</h2>
<table>
<tr><th>name</th><th>causality</th><th>unit</th><th>start</th><th></th></tr>
{rows}
</table>
<h2>Licence</h2>
{about}<p>The mechanism is in <code>resources/mechanism.toml</code>. The licences of the code in this FMU are in
<a href="licenses/license.txt">licenses/license.txt</a>.</p>
</body>
</html>
"""
_BY_INPUTS = """\
<p>Set <code>driven_by_time</code> to false, connect the inputs {inputs}, then read the outputs. A get after a set
returns values at the new inputs, without a step between them. Angles are continuous: a jump from 360 to 0 deg is a turn
back. Speed and acceleration inputs may be left unconnected. Co-simulation then estimates them from the samples until
they are first set to a value other than 0; the errors of the estimates fall with the step as h<sup>2</sup> and h. Set
the parameter <code>rates</code> to 2 if all inputs are connected. Model exchange does not estimate: unconnected inputs
are 0.</p>"""
_BY_EFFORTS = """\
<p>The efforts {inputs} are inputs, 0 at the start. The FMU owns the motion: {states} are states, with settable start
values. In co-simulation it integrates them by an embedded Runge-Kutta pair of order 8, with the error of a step kept
below <code>integrator.tolerance</code>; inputs are held during a step of the host, unless a native FMU is given their
derivatives (FMI 2.0) or their values inside the step (FMI 3.0). Jumps of loads and breaks of cams' laws restart
the integrator. Model exchange gives the states to the host. A motion ends at a limit of its drivers: the
step returns Discard, and the states stay those at its start; in model exchange the FMU asks to terminate.</p>"""


def page(
    plan: SolvePlan,
    interface: Interface,
    *,
    picture: str = "",
    reach: DriverRange | None = None,
    reference: ReferenceResults | None = None,
    metadata: Mapping[str, str] = MappingProxyType({}),
) -> str:
    """Return the page as HTML.

    Args:
        plan: Plan of the mechanism.
        interface: Variables of the FMU.
        picture: SVG of the mechanism, if any.
        reach: Range of the only driver, if it is known.
        reference: Reference results in the FMU, if any.
        metadata: Attributes of the model description, such as `author`.

    """
    has_forces = any(interface.part(part) for part in ("forces", "reactions", "shaking"))
    return _PAGE.format(
        title=escape(interface.title or interface.name),
        forces=" with its forces" if has_forces else "",
        unit=escape(interface.length_unit),
        picture=picture,
        drivers=_drivers(plan, interface.length_unit, reach),
        driven=_driven(interface),
        wiring=_wiring(interface),
        port=_port(plan, interface),
        statuses=", ".join(f"{int(status)} {status.name.lower()}" for status in Status),
        unknown=UNKNOWN_ERROR,
        reference=_reference(interface.name, reference),
        about="".join(f"<p>{name.capitalize()}: {escape(text)}</p>\n" for name, text in _stated(metadata).items()),
        rows="\n".join(_row(variable, plan.mechanism) for variable in interface),
    )


def _stated(metadata: Mapping[str, str]) -> dict[str, str]:
    return {"date" if name == "generationDateAndTime" else name: text for name, text in metadata.items()}


def _driven(interface: Interface) -> str:
    """Return what drives the FMU by default."""
    if interface.part("states"):
        return "This FMU is driven by efforts; the laws give values and speeds at the start."
    if interface.part("drive")[0].start:
        return (
            "This FMU is driven by time, by the laws above; their constants are parameters. The parameter "
            "<code>driven_by_time</code> = false lets the inputs drive."
        )
    return (
        "This FMU is driven by its inputs. The parameter <code>driven_by_time</code> = true lets the laws above drive."
    )


def _wiring(interface: Interface) -> str:
    """Return how the inputs are connected."""
    if interface.part("states"):
        states = [variable for variable in interface.part("states") if variable.start is not None]
        return _BY_EFFORTS.format(inputs=_listed(interface.part("efforts")), states=_listed(states))
    return _BY_INPUTS.format(inputs=_listed(interface.part("inputs")) or "(there are none)")


def _listed(variables: Iterable[Variable]) -> str:
    return ", ".join(f"<code>{escape(variable.name)}</code>" for variable in variables)


def _drivers(plan: SolvePlan, length_unit: str, reach: DriverRange | None) -> str:
    """Return the table of drivers: what moves, by which law, in which range, with which singular places."""
    rows = []
    for driver in plan.mechanism.drivers:
        known = reach is not None and reach.driver == driver.name
        where = _range(reach, length_unit) if reach is not None and known else "see <code>kinfmu check</code>"
        cells = (escape(driver.name), escape(driver.quantity.kind), escape(_law(plan, driver)), where)
        rows.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    if not rows:
        return "<p>The mechanism has no drivers.</p>"
    head = "<tr><th>driver</th><th>quantity</th><th>law</th><th>range and singular places</th></tr>"
    return "\n".join(["<table>", head, *rows, "</table>"])


def _law(plan: SolvePlan, driver: Driver) -> str:
    """Return a law with its constants, in units of the file: 'constant_speed: start = 0 deg, speed = 3000 rpm'."""
    settable = plan.mechanism.settable
    constants = ", ".join(
        f"{constant.key} = "
        + (
            _shown(float(constant.value), settable.display_unit(f"{constant.owner}.{constant.key}"))
            if given_unit(constant.value)
            else _value(constant.value, constant.quantity, plan.mechanism.length_unit)
        )
        for constant in plan.law_constants
        if constant.owner == driver.name
    )
    return f"{driver.law.type}{': ' if constants else ''}{constants}"


def _value(value: float, quantity: Quantity, length_unit: str) -> str:
    """Return a number with its unit; angles in degrees."""
    unit = unit_of(quantity, length_unit)
    if unit.startswith("rad"):
        value, unit = math.degrees(value), f"deg{unit.removeprefix('rad')}"
    return _shown(value, DisplayUnit(unit))


def _shown(value: float, shown: DisplayUnit) -> str:
    return f"{round(value / shown.factor, 9) + 0.0:.8g}{shown.suffix}"


def _range(reach: DriverRange, length_unit: str) -> str:
    quantity = Quantity(reach.kind)
    limits = [f"{_value(limit.value, quantity, length_unit)} ({limit.kind})" for limit in reach.limits]
    names = ["from", "up to"] if len(limits) == 2 else ["from" if reach.lowest else "up to"]
    text = " ".join(f"{name} {limit}" for name, limit in zip(names, limits, strict=False))
    if not limits:
        text = "unlimited" if reach.turns is not None else "no limit found"
    crossed = [_value(point.value, quantity, length_unit) for point in reach.points if point.kind == "change point"]
    return escape(text + (f"; change points at {', '.join(crossed)}" if crossed else "; no change points"))


def _port(plan: SolvePlan, interface: Interface) -> str:
    """Return how a drive is coupled, if the FMU has what that needs."""
    names = set() if interface.part("states") else {variable.name for variable in interface.part("forces")}
    ports = []
    for driver in plan.drivers:
        noun = "torque" if driver.quantity.kind == "angle" else "force"
        needed = (f"{driver.name}.reduced_inertia", f"{driver.name}.bias_{noun}")
        if names.issuperset(needed):
            inertia, bias = (f"<code>{escape(name)}</code>" for name in needed)
            ports.append(f"{noun} of {escape(driver.name)} = {inertia} &middot; acceleration + {bias}")
    if not ports:
        return ""
    return (
        f"<p>To couple a drive: {'; '.join(ports)}. Pass inertia and bias to the drive, let it solve for its "
        "acceleration with its own inertia added, and return angle or position, speed and acceleration. Neither "
        "depends on the acceleration, so there is no algebraic loop. Do not exchange the torque for the acceleration: "
        "that is unstable where the mechanism is heavier than the drive.</p>"
    )


def _reference(name: str, found: ReferenceResults | None) -> str:
    if found is None:
        return "<p>This FMU holds no reference results.</p>"
    name = escape(name)
    inputs = f" with the inputs in <code>{name}_in.csv</code>" if found.input_names else ""
    return (
        f"<p><code>{FOLDER}/{name}_ref.csv</code> holds the outputs at {len(found.t)} samples from {found.t[0]:g} to "
        f"{found.t[-1]:g} s in steps of {found.step:g} s{inputs}. Record them in your host as CSV, then type "
        f"<code>kinfmu verify {name}.fmu --results host.csv</code>; relative tolerance {found.tolerance:g}.</p>"
    )


def _row(variable: Variable, mechanism: Mechanism) -> str:
    """Return the row of a variable, with its start also in the unit of the file, if that is another one."""
    start = "" if variable.start is None else repr(variable.start)
    if variable.name in mechanism.settable.names and variable.start is not None:
        shown = mechanism.settable.display_unit(variable.name)
        start += "" if shown.unit in ("1", variable.unit) else f" ({_shown(float(variable.start), shown)})"
    cells = (variable.name, variable.causality, variable.unit or "", start, variable.description)
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"
