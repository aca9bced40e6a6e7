"""documentation/index.html of an FMU: what it is, how it is driven, its variables."""

from __future__ import annotations

from html import escape

from kinfmu.fmu.interface import Interface, Variable
from kinfmu.solver.status import Status

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>{title}</title>
<style>body {{ font-family: sans-serif; max-width: 60em; margin: 2em auto }} td, th {{ padding: 0 1em 0 0;
text-align: left; vertical-align: top }}</style></head>
<body>
<h1>{title}</h1>
<p>Kinematics of a planar mechanism, solved to round-off. Lengths are in {unit}, angles in rad.</p>
<h2>Driving it</h2>
<p>While <code>driven_by_time</code> is true the law in the mechanism file drives; its constants are parameters. While
it is false the inputs drive: {inputs}. Outputs follow a set input at once. Speed and acceleration inputs may stay
unwired: in co-simulation they are then estimated from the samples, until they are first set to other than 0, with
errors that fall with the step as h<sup>2</sup> and h. Model exchange takes them as they are: unwired they are 0.
<code>solver.error_qd</code> and <code>solver.error_qdd</code> count these errors; they are infinite at the first two
and three samples, of which nothing is known.</p>
<h2>When a pose cannot be reached</h2>
<p><code>solver.status</code> says so, outputs keep the last good values, <code>solver.message</code> names driver,
value and limit, and the next step is Discard (in FMUs of native code a get of positions, rates and accelerations, too).
The host may set other inputs and go on. Status: {statuses}.</p>
<h2>Variables</h2>
<table>
<tr><th>name</th><th>causality</th><th>unit</th><th>start</th><th></th></tr>
{rows}
</table>
<p>The mechanism itself is in <code>resources/mechanism.toml</code>.</p>
</body>
</html>
"""


def page(interface: Interface) -> str:
    """The page as HTML."""
    return _PAGE.format(
        title=escape(interface.title or interface.name),
        unit=escape(interface.length_unit),
        inputs=", ".join(f"<code>{escape(v.name)}</code>" for v in interface.part("inputs")) or "there are none",
        statuses=", ".join(f"{int(status)} {status.name.lower()}" for status in Status),
        rows="\n".join(_row(variable) for variable in interface),
    )


def _row(variable: Variable) -> str:
    start = "" if variable.start is None else repr(variable.start)
    cells = (variable.name, variable.causality, variable.unit or "", start, variable.description)
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"
