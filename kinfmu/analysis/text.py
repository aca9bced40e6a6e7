"""The findings of a check as text."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sized
from functools import partial
from typing import NamedTuple

from kinfmu.analysis.cams import cam_lines
from kinfmu.analysis.driver_path import degrees, driver_text, multiple_of_pi, place_text, value_text
from kinfmu.analysis.findings import Findings
from kinfmu.analysis.loading import ForcePeak, ForceRange, LeftTable, LiftOff, UnknownContact
from kinfmu.analysis.loops import FourBar, Link, SliderCrank
from kinfmu.analysis.singular import DriverRange, LimitPosition
from kinfmu.analysis.transmission import NamedLoop, TransmissionRange
from kinfmu.errors import MOST_SHOWN, listed, some
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.measures import counted_from
from kinfmu.motion import MeasuredValue

_MOST_LOOPS = 8  # in the text; JSON has all
_END = {
    "dead centre": "a dead centre",
    "change point": "where branches cross and the motion cannot continue",
    "pole": "where a slide runs to infinity",
    "end": "where the distance is 0",
}
_SAME = 1e-9  # [rad or length]; values closer than this are equal


class ReportLine(NamedTuple):
    """A line of the report; subject: '' if it continues the line before."""

    subject: str
    text: str


def findings(report: Findings) -> list[ReportLine]:
    """Return the findings in order."""
    found: list[ReportLine] = []
    for parts in (
        _count,
        _rows,
        _plan,
        _mismatch,
        _loops,
        _dyads,
        _motion,
        _toggles,
        _cams,
        _measures,
        _forces,
        _notes,
        _advice,
    ):
        found += parts(report)
    if report.problem is not None:
        found.append(ReportLine("problem", str(report.problem)))
    return found


def title(mechanism: Mechanism) -> str:
    """Return the name and the title of a mechanism."""
    return f"{mechanism.name}: {mechanism.title}" if mechanism.title else mechanism.name


def lines(report: Findings) -> list[str]:
    """Return the findings, one per line, each after its subject."""
    return [title(report.mechanism), *(f"  {found.subject:<12}{found.text}" for found in findings(report))]


def _rest(parts: Sized, most: int, what: str) -> Iterator[ReportLine]:
    """Yield how many more parts there are than the text shows."""
    if len(parts) > most:
        yield ReportLine("", f"and {len(parts) - most} more {what}")


def _count(report: Findings) -> Iterator[ReportLine]:
    mechanism = report.mechanism
    rows = sum(len(joint.labels) for joint in mechanism.joints)
    moving = mechanism.moving_bodies
    yield ReportLine("bodies", f"{len(moving)} moving: {some(body.name for body in moving)}")
    yield ReportLine("joint rows", f"{rows} over {len(mechanism.coordinate_names)} coordinates")
    driven = [f"driven by {some(driver.name for driver in mechanism.drivers)}"] if mechanism.drivers else []
    invalid = [name for name in report.left_out if name.startswith("[drivers")]
    without = [f"without {listed(invalid)}"] if invalid else []
    mobility = f"{report.mobility}" if report.mobility >= 0 else "none: the joints do not close"
    yield ReportLine("mobility", f"{mobility}, {listed([*driven, *without] or ['no driver'])}")
    if report.gruebler != report.mobility:
        yield ReportLine("", f"Gruebler's count gives {report.gruebler}, because it counts redundant rows")


def _rows(report: Findings) -> Iterator[ReportLine]:
    for row in report.redundant:
        within = f"{row.tolerance:.3g} {'rad' if row.row.kind == 'angle' else report.mechanism.length_unit}"
        reason = f"at every pose it follows from {listed(row.implied_by_joints)}, to within {within}"
        yield ReportLine("redundant", f"{row.row.owner} (row {row.row.name}): {reason}; set aside, residual monitored")
    if not report.redundancy.dependent:
        yield ReportLine("redundant", "none")
    for row in report.inconsistent:
        unit = "rad" if row.row.kind == "angle" else report.mechanism.length_unit
        gap = f"{abs(row.gap):.6g} {unit} at every pose; up to {row.tolerance:.3g} {unit} would count as redundant"
        reason = f"does not close with {listed(row.implied_by_joints)}: gap {gap}"
        yield ReportLine("contradicts", f"{row.row.owner} (row {row.row.name}) {reason}")


def _plan(report: Findings) -> Iterator[ReportLine]:
    plan = report.plan
    if plan is None:
        return
    unit = report.mechanism.length_unit
    drivers, assembled = report.mechanism.drivers, plan.anchor.u.tolist()
    yield ReportLine("start", some(map(partial(driver_text, unit=unit), drivers, report.starts)))
    if any(abs(u - start) > _SAME for u, start in zip(assembled, report.starts, strict=True)):
        yield ReportLine("assembled", some(map(partial(driver_text, unit=unit), drivers, assembled)))
    yield ReportLine("coordinates", some(plan.coordinates))
    if plan.fixed:
        yield ReportLine("fixed", some(f"{name} = {value:.6g}" for name, value in plan.fixed.items()))
    for k, block in enumerate(report.blocks[:MOST_SHOWN], start=1):
        size = f"{len(block.rows)} x {len(block.unknowns)}"
        determinant = f", determinant {block.determinant}" if block.determinant else ""
        yield ReportLine(f"block {k}", f"{size}: {listed(block.unknowns)} from {listed(block.rows)}{determinant}")
    yield from _rest(report.blocks, MOST_SHOWN, "blocks")


def _mismatch(report: Findings) -> Iterator[ReportLine]:
    mismatch = report.mismatch
    if mismatch is None:
        return
    for surplus in mismatch.surplus:
        by = f"{listed(surplus.implied_by)} and the joints" if surplus.implied_by else "the joints alone"
        yield ReportLine("surplus", f"driver {surplus.name}: {by} determine what it drives")
    if mismatch.missing:
        needed = f"{mismatch.missing} more driver{'s' * (mismatch.missing > 1)} needed"
        more = needed if report.mobility else "nothing drives"
        yield ReportLine("loose", f"{some(mismatch.loose)}: {more}")


def _advice(report: Findings) -> Iterator[ReportLine]:
    for one in report.advice:
        yield ReportLine("advice", one.text)
        yield ReportLine("", f"leads to: {one.leads_to}")
        for line in one.toml_lines():
            yield ReportLine("", f"    {line}")


def _loops(report: Findings) -> Iterator[ReportLine]:
    unit = report.mechanism.length_unit
    for named in report.loops[:_MOST_LOOPS]:
        loop = named.loop
        if isinstance(loop, FourBar):
            links = zip(("ground", *loop.links), loop.lengths, strict=True)
            yield ReportLine("loop", f"four-bar: {listed(f'{name} {length:.6g}' for name, length in links)} {unit}")
            yield ReportLine("", _four_bar_class(named, loop))
        else:
            sizes = f"{_sized('crank', loop.crank)}, {_sized('rod', loop.rod)}"
            yield ReportLine("loop", f"slider-crank: {sizes}, offset {loop.offset:.6g} {unit}")
            yield ReportLine("", _slider_crank_class(named, loop))
        for angle in named.transmission:
            yield ReportLine("", _transmission(angle, unit))
    yield from _rest(report.loops, _MOST_LOOPS, "four-bars and slider-cranks")


def _dyads(report: Findings) -> Iterator[ReportLine]:
    unit = report.mechanism.length_unit
    for named in report.dyads[:_MOST_LOOPS]:
        dyad = named.dyad
        bodies = " and ".join(dict.fromkeys(place.body for place in (named.pins[0], *named.pins[2:])))
        first = f"{dyad.first.name} {dyad.first.length:.6g}"
        if dyad.direction is None:
            at = f" at {dyad.joint}" if dyad.joint else ""
            sizes = f"{first}, {dyad.second.name} {dyad.second.length:.6g} {unit}"
            yield ReportLine("dyad", f"{sizes}; they meet{at}, between {bodies}")
        else:
            yield ReportLine("dyad", f"{first} {unit} between {bodies} and the slide {dyad.second.name}")
        for angle in named.transmission:
            yield ReportLine("", _transmission(angle, unit))
    yield from _rest(report.dyads, _MOST_LOOPS, "dyads")


def _sized(role: str, link: Link) -> str:
    """Return the role, name and length of a link; the name only where it differs from the role."""
    return f"{role} {link.length:.6g}" if link.name == role else f"{role} {link.name} {link.length:.6g}"


def _four_bar_class(named: NamedLoop, loop: FourBar) -> str:
    kind, first, coupler, last = named.grashof, *loop.links
    if kind.name == "does not close":
        return (
            f"does not close: its longest side ({kind.small:.6g}) is longer than the others together ({kind.large:.6g})"
        )
    assembled = f"{named.assembly} as assembled" if named.assembly else ""
    sign = _sign(kind.small, kind.large, kind.name)
    sums = f"shortest + longest ({kind.small:.6g}) {sign} sum of the two others ({kind.large:.6g})"
    if kind.name == "change point":
        words = [kind.shape] if kind.shape else []
        words += [assembled] if assembled and "parallelogram" not in kind.shape else []
        return f"change point{f' ({listed(words)})' if words else ''}: {sums}; the links can fall in line"
    turns = {
        "crank-rocker": f"{first} can turn all the way round, {last} rocks",
        "rocker-crank": f"{last} can turn all the way round, {first} rocks",
        "double crank": f"{first} and {last} can turn all the way round",
        "double rocker": f"{coupler} can turn all the way round, {first} and {last} rock",
        "triple rocker": "no link can turn all the way round",
    }
    return f"{listed([kind.name, *([assembled] if assembled else [])])}: {sums}; {turns[kind.name]}"


def _slider_crank_class(named: NamedLoop, loop: SliderCrank) -> str:
    kind = named.grashof
    if kind.name == "does not close":
        return f"does not close: the offset of the slide is {kind.small:.6g}, crank and rod reach {kind.large:.6g}"
    shorter, longer = ("crank", "rod") if loop.crank.length <= loop.rod.length else ("rod", "crank")
    sign = _sign(kind.small, kind.large, kind.name)
    sums = f"{shorter} + offset ({kind.small:.6g}) {sign} {longer} ({kind.large:.6g})"
    turns = {
        "crank turns": f"{loop.crank.name} can turn all the way round",
        "rod turns": f"{loop.rod.name} can turn all the way round, {loop.crank.name} rocks",
        "nothing turns": f"{loop.crank.name} cannot turn all the way round",
        "change point": "branches cross where all is in line",
    }
    return f"{sums}; {turns[kind.name]}"


def _sign(small: float, large: float, name: str) -> str:
    return "=" if name == "change point" else "<" if small < large else ">"


def _transmission(angle: TransmissionRange, unit: str) -> str:
    at = [
        f"{angle.driver} at {degrees(u) if angle.kind == 'angle' else f'{round(u, 9) + 0.0:.6g} {unit}'}"
        for u in (angle.at_smallest, angle.at_largest)
    ]
    span = f"{degrees(angle.smallest)} ({at[0]}) to {degrees(angle.largest)} ({at[1]})"
    verdict = {"good": "good", "poor": "poor (40 deg from 0 and 180 deg is usual)", "locks": _in_line(angle)}
    return f"transmission angle {span}: {verdict[angle.verdict]}"


def _in_line(angle: TransmissionRange) -> str:
    """Return the position of the links at a transmission angle of 0 or 180 degrees."""
    both = f"{angle.coupler} and {angle.output} fall in line"
    return f"{angle.coupler} is perpendicular to the slide" if angle.is_slide else both


def _motion(report: Findings) -> Iterator[ReportLine]:
    several = len(report.mechanism.drivers) > 1
    for reach in report.ranges:
        yield from _change_points(report, reach, several)
    for reach in report.ranges:
        yield from _range(report, reach)
    if several and report.ranges:
        yield ReportLine("", "each with the other drivers at their start values")
    if report.ranges and not report.singular and not any(reach.stopped for reach in report.ranges):
        yield ReportLine("singular", "none in the range")


def _toggles(report: Findings) -> Iterator[ReportLine]:
    for k, toggle in enumerate(report.toggles[:_MOST_LOOPS]):
        at = value_text(toggle.value, report.mechanism.length_unit, toggle.kind)
        yield ReportLine("" if k else "toggle", f"{toggle.happens} at {toggle.driver} = {at}")
    yield from _rest(report.toggles, _MOST_LOOPS, "toggle positions")


def _cams(report: Findings) -> Iterator[ReportLine]:
    texts = [text for cam in report.cams for text in cam_lines(cam)]
    for k, text in enumerate(texts):
        yield ReportLine("" if k else "cam", text)


def _measures(report: Findings) -> Iterator[ReportLine]:
    measured = report.measured
    if measured is None:
        return
    yield ReportLine("measures", f"over {measured.over}{_without_loads(report)}")
    for value in measured.values:
        text = _no_value(value.name, value.reason) if value.reason else f"{value.name} = {measured_text(value)}"
        yield ReportLine("", text)
    for name, reason in measured.refused.items():
        yield ReportLine("", _no_value(name, reason))


def _forces(report: Findings) -> Iterator[ReportLine]:
    loading = report.loading
    if loading is None:
        return
    missing = f"; {loading.missing} samples have no numbers" if loading.missing and not loading.reason else ""
    yield ReportLine("forces", f"over {loading.over}{_without_loads(report)}{missing}")
    if loading.reason:
        yield ReportLine("", f"no values, because {loading.reason}")
    if loading.gravity is not None:
        yield ReportLine("", f"gravity: ({loading.gravity[0]:.6g}, {loading.gravity[1]:.6g}) m/s2")
    for effort in loading.efforts:
        yield ReportLine("", f"{effort.name}: peak {_peak_text(effort)}, rms {effort.rms:.6g} {effort.unit}")
    for inertia in loading.inertias:
        yield ReportLine("", f"{inertia.name}: {_extent(inertia)}")
    for of_effort, of_quantity in zip(loading.loads[::2], loading.loads[1::2], strict=True):
        name, _, noun = of_effort.name.rpartition(".")
        quantity = f"{of_quantity.name.rpartition('.')[2]} {_extent(of_quantity)}"
        yield ReportLine("", f"{name}: {noun} {_extent(of_effort)}, {quantity}")
    if loading.reaction is not None:
        yield ReportLine("", f"largest reaction: {loading.reaction.name} {_peak_text(loading.reaction)}")
    texts = [f"{peak.name}: peak {_peak_text(peak)}" for peak in loading.shaking]
    texts += [*map(_left_table_text, loading.left_tables), *map(_lift_off_text, loading.lift_offs)]
    for text in (*texts, *map(contact_text, loading.unknown_contacts)):
        yield ReportLine("", text)
    redundant = {row.row.name: row.row.owner for row in report.redundant}
    for names, rows in loading.undetermined:
        others = [row for row in rows if row in redundant]
        joints = {redundant[row] for row in others}
        shared = [name for name in names if name.partition(".")[0] not in joints]
        yield ReportLine("", f"statically indeterminate: {some(shared)} share the load with {some(others)}")


def _extent(span: ForceRange) -> str:
    return f"{span.smallest:.6g} to {span.largest:.6g} {span.unit}"


def _left_table_text(one: LeftTable) -> str:
    """Return what a load does beyond its table."""

    def extent(ends: tuple[float, float]) -> str:
        return f"from {place_text(ends[0], one.unit)} to {place_text(ends[1], one.unit)}"

    (first, last), (low, high) = one.table, one.reached
    kept = [f"{one.kept[0]:.6g} {one.effort_unit} before it"] if low < first else []
    kept += [f"{one.kept[1]:.6g} {one.effort_unit} after it"] if high > last else []
    both = f"its table goes {extent(one.table)}, the motion {extent(one.reached)}"
    return f"{one.load}: {both}; it keeps {' and '.join(kept)}"


def _without_loads(report: Findings) -> str:
    """Return ', without [loads.spring]' for the loads that the report leaves out; '' if there are none."""
    names = [name for name in report.left_out if name.startswith("[loads")]
    return f", without {listed(names)}" if names else ""


def contact_text(contact: UnknownContact) -> str:
    """Return why the contact force of a cam is unknown, and which reactions have no value for this reason."""
    loaded = some(contact.reactions)
    return f"{contact.joint}: contact force unknown, {contact.reason}; without a value: {loaded}"


def _lift_off_text(lift: LiftOff) -> str:
    """Return where a follower lifts off, and the tension that would hold it."""
    at = partial(place_text, unit=lift.at_unit)
    parts = listed([f"{at(begin)} to {at(end)}" for begin, end in lift.parts])
    extents = {"turn": f"at every angle of {lift.driver}", "motion": "in the whole motion"}
    where = extents.get(lift.extent, f"from {parts} of {lift.driver}")
    sign = "negative" if lift.sense > 0 else "positive"
    kind, pull = ("moment", "moment that pulls") if lift.force.endswith("moment") else ("force", "tension")
    return (
        f"{lift.joint}: the follower lifts off: contact {kind} {lift.force} {sign} {where}; "
        f"largest {pull} {lift.largest:.6g} {lift.unit} ({lift.driver} at {at(lift.at)})"
    )


def _peak_text(peak: ForcePeak) -> str:
    """Return a peak with its unit and where it occurs: '-12.3 N m (crank at 45 deg)'."""
    if not math.isfinite(peak.value):
        return "without a finite value"
    return f"{peak.value:.6g} {peak.unit} ({peak.driver} at {place_text(peak.at, peak.at_unit)})"


def _no_value(name: str, reason: str) -> str:
    return f"{name}: no value, because {reason}"


def measured_text(value: MeasuredValue) -> str:
    """Return a value with its unit and the driver values where it occurs."""
    number = value_text(value.value, value.unit, "angle" if value.unit == "rad" else "length")
    at = [place_text(u, value.at_unit) for u in value.at]
    places = f" ({value.driver} at {' and '.join(at)})" if at else ""
    return f"{number.removesuffix(' 1')}{counted_from(value.type)}{places}"


def _notes(report: Findings) -> Iterator[ReportLine]:
    for note in report.notes:
        yield ReportLine("note", note)


def _change_points(report: Findings, reach: DriverRange, several: bool) -> Iterator[ReportLine]:
    ends = (reach.low, reach.high)
    changes = [point.value for point in reach.points if point.kind == "change point" and point.value not in ends]
    if changes:
        places = some(value_text(value, report.mechanism.length_unit, reach.kind) for value in changes)
        turned = {multiple_of_pi(value % math.tau) for value in changes}
        every = "k pi: " if reach.turns == 1 and len(changes) == 2 and turned <= {"0", "pi", "2 pi"} else ""
        goes_on = "with several drivers no run can cross it" if several else "the motion goes on (bridged)"
        yield ReportLine("singular", f"{reach.driver} = {every}{places}; branches cross, {goes_on}")


def _range(report: Findings, reach: DriverRange) -> Iterator[ReportLine]:
    unit = report.mechanism.length_unit
    seen = [value_text(end, unit, reach.kind) for end in reach.reach]
    limits = reach.limits
    ends = [value_text(limit.value, unit, reach.kind) for limit in limits]
    kinds = [_END[limit.kind] for limit in limits]
    if reach.stopped is not None:
        text = f" was followed from {seen[0]} to {seen[1]}; then: {reach.stopped}"
    elif all(limit.kind == "dead centre" for limit in limits) and len(limits) == 2:
        text = f" from {ends[0]} to {ends[1]}; dead centre at each limit"
    elif len(limits) == 2:
        text = f" from {ends[0]}, {kinds[0]}, to {ends[1]}, {kinds[1]}"
    elif reach.lowest is not None:
        text = f" from {ends[0]}, {kinds[0]}; no limit up to {seen[1]}"
    elif reach.highest is not None:
        text = f" up to {ends[0]}, {kinds[0]}; no limit down to {seen[0]}"
    elif reach.turns is not None:
        repeats = f"; the mechanism repeats after {reach.turns} turns" if reach.turns > 1 else ""
        text = f" turns all the way round{repeats}"
    else:
        text = f": no limit from {seen[0]} to {seen[1]}"
    yield ReportLine("range", f"{reach.driver}{text}")
    for limit, end in zip(limits, ends, strict=True):
        if limit.bodies:
            yield ReportLine("", f"at {end} {_limit_reason(report, reach, limit)}")


def _limit_reason(report: Findings, reach: DriverRange, limit: LimitPosition) -> str:
    """Return the reason of a limit: two links in line, or bodies that can move."""
    angles = [angle for named in report.loops for angle in named.transmission]
    for angle in angles + [angle for named in report.dyads for angle in named.transmission]:
        if angle.driver == reach.driver and limit.value in angle.in_line_at:
            return _in_line(angle)
    return f"{some(limit.bodies)} can move while {reach.driver} is fixed"
