"""documentation/index.html of an FMU: the mechanism, its drivers and its variables."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

from kinfmu.fmu.interface import Interface, Variable
from kinfmu.fmu.layout import UNKNOWN_ERROR
from kinfmu.solver.python.status import Status

_MIT = """\
MIT License

Copyright (c) 2026 The kinfmu authors

Permission is hereby granted, free of charge, to any person obtaining a copy
of this software and associated documentation files (the "Software"), to deal
in the Software without restriction, including without limitation the rights
to use, copy, modify, merge, publish, distribute, sublicense, and/or sell
copies of the Software, and to permit persons to whom the Software is
furnished to do so, subject to the following conditions:

The above copyright notice and this permission notice shall be included in all
copies or substantial portions of the Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR
IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY,
FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE
AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER
LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM,
OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE
SOFTWARE.
"""

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>{title}</title>
<style>body {{ font-family: sans-serif; max-width: 60em; margin: 2em auto }} td, th {{ padding: 0 1em 0 0;
text-align: left; vertical-align: top }}</style></head>
<body>
<h1>{title}</h1>
<p>Kinematics of a planar mechanism, solved to round-off. Unit of length: {unit}; angles in rad.</p>
<h2>Drivers</h2>
{drivers}
<h2>When a pose cannot be reached</h2>
<p><code>solver.status</code> reports it, outputs keep the last good values, <code>solver.message</code> states driver,
value and limit, and the next step returns Discard (in native FMUs also a get of positions, rates and accelerations).
The host may set other inputs and continue. Status: {statuses}.</p>
<h2>Variables</h2>
<table>
<tr><th>name</th><th>causality</th><th>unit</th><th>start</th><th></th></tr>
{rows}
</table>
<p>The mechanism itself is in <code>resources/mechanism.toml</code>.</p>
</body>
</html>
"""
_BY_LAWS_OR_INPUTS = """\
<p>If <code>driven_by_time</code> is true, the law in the mechanism file drives; its constants are parameters. If it is
false, the inputs drive: {inputs}. A get after a set returns values at the new inputs, without a step between them.
Speed and acceleration inputs may be left unconnected. Co-simulation then estimates them from the samples until they
are first set to a value other than 0; the errors of the estimates fall with the step as h<sup>2</sup> and h. Model
exchange does not estimate: unconnected inputs are 0. <code>solver.error_qd</code> and <code>solver.error_qdd</code>
include these errors. Where the errors are unknown (<code>solver.error_qd</code> at the first two samples,
<code>solver.error_qdd</code> at the first three) they are {unknown:g}.</p>"""
_BY_EFFORTS = """\
<p>The efforts {inputs} are inputs, 0 at the start. The FMU owns the motion: {states} are states, with settable start
values. In co-simulation it integrates them by an embedded Runge-Kutta pair of order 8, with the error of a step kept
below <code>integrator.tolerance</code>; inputs are held during a step of the host, and jumps of loads over time restart
the integrator. Model exchange gives the states to the host. A motion ends at a limit of its drivers: the step returns
Discard, and the states stay those at its start; in model exchange the FMU asks to terminate.</p>"""


def licence(*others: str) -> str:
    """Return documentation/licenses/license.txt: kinfmu's licence and other code inside.

    Args:
        others: Other code and the file of its licence, such as "pythonfmu, in pythonfmu.txt".

    """
    also = "".join(f"It also holds code of {other}.\n" for other in others)
    return f"""\
This FMU holds code of kinfmu, under the MIT License below. The mechanism in it belongs to its author.
{also}
{_MIT}"""


def page(interface: Interface) -> str:
    """Return the page as HTML."""
    return _PAGE.format(
        title=escape(interface.title or interface.name),
        unit=escape(interface.length_unit),
        drivers=_drivers(interface),
        statuses=", ".join(f"{int(status)} {status.name.lower()}" for status in Status),
        rows="\n".join(_row(variable) for variable in interface),
    )


def _drivers(interface: Interface) -> str:
    """Return the paragraph on what moves the drivers."""
    if interface.part("states"):
        states = [variable for variable in interface.part("states") if variable.start is not None]
        return _BY_EFFORTS.format(inputs=_listed(interface.part("efforts")), states=_listed(states))
    inputs = _listed(interface.part("inputs")) or "there are none"
    return _BY_LAWS_OR_INPUTS.format(inputs=inputs, unknown=UNKNOWN_ERROR)


def _listed(variables: Iterable[Variable]) -> str:
    return ", ".join(f"<code>{escape(variable.name)}</code>" for variable in variables)


def _row(variable: Variable) -> str:
    start = "" if variable.start is None else repr(variable.start)
    cells = (variable.name, variable.causality, variable.unit or "", start, variable.description)
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"
