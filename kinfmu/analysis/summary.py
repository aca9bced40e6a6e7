"""The findings of a check as verdicts and tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial

from kinfmu.analysis.cams import CamFindings
from kinfmu.analysis.driver_path import degrees
from kinfmu.analysis.file_notes import LEAVES_RANGE
from kinfmu.analysis.findings import Findings
from kinfmu.analysis.loading import ForceRange, LeftTable, LiftOff, UnknownContact
from kinfmu.analysis.loops import FourBar
from kinfmu.analysis.singular import DriverRange, LimitPosition
from kinfmu.analysis.transmission import POOR, NamedDyad, NamedLoop, TransmissionRange
from kinfmu.display import Poor, Summary, Table, Verdict
from kinfmu.errors import listed, some
from kinfmu.mechanism.measures import counted_from
from kinfmu.motion import MeasuredValue
from kinfmu.motion.cams import CamExtreme

_MOST = 8  # rows of a table and lines of a kind; JSON has all
_DIGITS, _ALL_DIGITS = 4, 9
_NONE = 1e-12  # [rad]; a smaller pressure angle is 0
_LEVELS = ("ok", "note", "poor", "problem", "advice")
_END = {
    "dead centre": "dead centre",
    "change point": "branches cross and the motion cannot continue",
    "pole": "a slide runs to infinity",
    "end": "distance 0",
}


def summary(report: Findings, *, detail: bool = False) -> Summary:
    """Return verdicts and tables of a report; detail: with all digits, coordinates, fixed values and blocks."""
    return _Summary(report, detail=detail).whole()


class _Summary:
    """Makes the verdicts and tables of a report."""

    def __init__(self, report: Findings, *, detail: bool) -> None:
        self._report, self._detail = report, detail
        self._digits = _ALL_DIGITS if detail else _DIGITS
        self._unit = report.mechanism.length_unit

    def whole(self) -> Summary:
        mechanism = self._report.mechanism
        parts: tuple[Callable[[], Iterator[Verdict]], ...]
        parts = (
            self._motion,
            self._count,
            self._singular,
            self._transmission,
            self._open_loops,
            self._cams,
            self._forces,
        )
        verdicts = [verdict for part in (*parts, self._notes, self._problem) for verdict in part()]
        verdicts.sort(key=lambda verdict: _LEVELS.index(verdict.level))
        kinds = (self._ranges, self._loops, self._angles, self._cam_tables, self._measures, self._force_tables)
        tables = [table for kind in kinds for table in kind() if table.rows]
        if self._detail:
            tables.append(Table(("detail", ""), tuple(self._details()), left=2))
        return Summary(mechanism.name, mechanism.title, tuple(verdicts), tuple(tables))

    # ------------------------------------------------------------------------------------------------------- numbers

    def _number(self, value: float) -> str:
        return _rounded(value, self._digits)

    def _value(self, value: float, unit: str) -> str:
        return value_with_unit(value, unit, self._digits)

    def _length(self, value: float) -> str:
        return self._number(round(value, 9))

    def _at(self, kind: str) -> str:
        """Return the unit of a driver's values."""
        return "rad" if kind == "angle" else self._unit

    def _driver_values(self, values: Iterable[float]) -> str:
        drivers = self._report.mechanism.drivers
        shown = zip(drivers, values, strict=True)
        return some(f"{driver.name} = {self._value(u, self._at(driver.quantity.kind))}" for driver, u in shown)

    # ------------------------------------------------------------------------------------------------------ verdicts

    def _motion(self) -> Iterator[Verdict]:
        """Yield how the drivers move the mechanism."""
        report = self._report
        ranges, count = report.ranges, len(report.mechanism.drivers)
        if report.plan is None:
            return
        how = f"Moves with {'one driver' if count == 1 else f'{count} drivers'}"
        if count == 1 and ranges:
            reach = ranges[0]
            yield Verdict("poor" if reach.stopped else "ok", f"{how}: {reach.driver} {self._reach(reach)}")
        else:
            names = some(driver.name for driver in report.mechanism.drivers)
            yield Verdict("ok", f"{how}: {names}" if count else "Nothing drives it, and nothing can move")
        yield from (Verdict("poor", f"{one.driver} {self._reach(one)}") for one in ranges if count > 1 and one.stopped)

    def _reach(self, reach: DriverRange) -> str:
        """Return the range of a driver, and the reasons of its limits."""
        first, last = (self._value(end, self._at(reach.kind)) for end in reach.reach)
        low, high = (
            limit and self._value(limit.value, self._at(reach.kind)) for limit in (reach.lowest, reach.highest)
        )
        if reach.stopped is not None:
            return f"was followed from {first} to {last}; then: {reach.stopped}"
        if reach.turns is not None:
            return "turns all the way round" + (f"; repeats after {reach.turns} turns" if reach.turns > 1 else "")
        if not reach.limits:
            return f"from {first} to {last} without a limit"
        return f"from {low or first} to {high or last}; {self._limits(reach)}"

    def _limits(self, reach: DriverRange) -> str:
        """Return the kinds and reasons of a driver's limits."""
        texts = []
        for end, limit in (("lower", reach.lowest), ("upper", reach.highest)):
            found = f"{_END[limit.kind]} at the {end} end{self._in_line(reach, limit)}" if limit else f"no {end} limit"
            texts.append(found)
        both = texts[0].replace("the lower end", "both ends")
        return both if both == texts[1].replace("the upper end", "both ends") else "; ".join(texts)

    def _in_line(self, reach: DriverRange, limit: LimitPosition) -> str:
        """Return the position of the links at a limit, where a transmission angle states it."""
        for angle in self._report_angles():
            if angle.driver == reach.driver and limit.value in angle.in_line_at:
                return f", {_in_line(angle)}"
        return ""

    def _report_angles(self) -> Iterator[TransmissionRange]:
        named: tuple[NamedLoop | NamedDyad, ...] = (*self._report.loops, *self._report.dyads)
        return (angle for one in named for angle in one.transmission)

    def _count(self) -> Iterator[Verdict]:
        """Yield what is counted, and what is redundant."""
        report, mechanism = self._report, self._report.mechanism
        bodies, joints = len(mechanism.moving_bodies), len(mechanism.joints)
        parts = [f"{bodies} moving {'body' if bodies == 1 else 'bodies'}", f"{joints} joint{'s' * (joints != 1)}"]
        invalid = [f"without {name}" for name in report.left_out if name.startswith("[drivers")]
        parts.append(f"mobility {report.mobility}" if report.mobility >= 0 else "the joints do not close")
        if report.gruebler != report.mobility >= 0:
            parts[-1] += f" (Gruebler's count {report.gruebler}: it counts redundant rows)"
        elif not report.redundancy.dependent:
            parts.append("no redundant constraint")
        if report.plan is None:
            driven = [f"driven by {some(driver.name for driver in mechanism.drivers)}"] if mechanism.drivers else []
            parts += [*driven, *invalid] or ["no driver"]
        yield Verdict("note" if report.problem else "ok", ", ".join(parts))
        implied_by: dict[str, dict[str, None]] = {}
        for row in report.redundant:
            implied_by.setdefault(row.row.owner, {}).update(dict.fromkeys(row.implied_by_joints))
        for name, others in list(implied_by.items())[:_MOST]:
            text = f"{name} is redundant: it follows from {listed(others)}; set aside, residual monitored"
            yield Verdict("note", text)
        if len(implied_by) > _MOST:
            yield Verdict("note", f"{len(implied_by) - _MOST} more joints are redundant")

    def _singular(self) -> Iterator[Verdict]:
        """Yield where branches cross."""
        report = self._report
        several = len(report.mechanism.drivers) > 1
        for reach in report.ranges:
            ends = (reach.low, reach.high)
            values = [point.value for point in reach.points if point.kind == "change point" and point.value not in ends]
            if values:
                places = some(self._value(value, self._at(reach.kind)) for value in values)
                goes_on = "with several drivers no run can cross it" if several else "the motion goes on (bridged)"
                where = f"Branches cross at {reach.driver} = {places}"
                yield Verdict("poor" if several else "note", f"{where}; {goes_on}")
        if report.ranges and not report.singular and not any(reach.stopped for reach in report.ranges):
            yield Verdict("ok", "No singular pose in the range")

    def _transmission(self) -> Iterator[Verdict]:
        """Yield the transmission angle that is nearest to 0 or 180 degrees without reaching it."""
        angles = [angle for angle in self._report_angles() if angle.verdict != "locks"]
        if angles:
            worst = min(angles, key=lambda angle: angle.worst)
            value = self._value(worst.smallest if worst.worst == worst.smallest else worst.largest, "rad")
            if worst.worst < POOR:
                what = f"Transmission angle {value} between {worst.coupler} and {worst.output}"
                yield Verdict("poor", f"{what} (40 deg from 0 and 180 deg is usual)")
            elif not any(angle.verdict == "locks" for angle in self._report_angles()):
                yield Verdict("ok", "Transmission angle 40 deg or more from 0 and 180 deg")

    def _open_loops(self) -> Iterator[Verdict]:
        """Yield loops whose lengths cannot close."""
        for named in self._report.loops:
            if named.grashof.name == "does not close":
                links = ("ground", *named.loop.links)
                yield Verdict("poor", f"{', '.join(links)} cannot close: {self._sums(named)}")

    def _cams(self) -> Iterator[Verdict]:
        """Yield the pressure angles of cams."""
        for cam in self._report.cams:
            if cam.cam is None:
                yield Verdict("note", f"{cam.joint}: no profile, because {cam.reason}")
            elif note := cam.note():
                yield Verdict("poor", note)
            elif cam.steepest is not None:
                worst = f"up to {self._value(abs(cam.steepest.value), 'rad')}, within {degrees(cam.limit)}"
                is_none = abs(cam.steepest.value) < _NONE
                yield Verdict("ok", f"cam '{cam.joint}': pressure angle {'0 everywhere' if is_none else worst}")
            if cam.cam is not None and cam.element == "unknown":
                text = "roller of unknown radius: 'roller_radius' in the file gives the profile"
                yield Verdict("note", f"cam '{cam.joint}': {text}")

    def _forces(self) -> Iterator[Verdict]:
        """Yield what is wrong with loads and contacts, and why measures have no value."""
        measured, loading = self._report.measured, self._report.loading
        if measured is not None:
            reasons = measured.refused | {value.name: value.reason for value in measured.values if value.reason}
            yield from (Verdict("note", f"{name}: no value, because {reason}") for name, reason in reasons.items())
        if loading is None:
            return
        if loading.reason:
            yield Verdict("poor", f"No forces, because {loading.reason}")
        elif loading.missing:
            yield Verdict("poor", f"{loading.missing} samples have no forces")
        yield from (Verdict("note", self._left_table(one)) for one in loading.left_tables)
        yield from (Verdict("poor", self._lift_off(one)) for one in loading.lift_offs)
        yield from (Verdict("note", contact_text(one)) for one in loading.unknown_contacts)
        redundant = {row.row.name: row.row.owner for row in self._report.redundant}
        for names, rows in loading.undetermined:
            others = [row for row in rows if row in redundant]
            joints = {redundant[row] for row in others}
            shared = [name for name in names if name.partition(".")[0] not in joints]
            yield Verdict("note", f"Statically indeterminate: {some(shared)} share the load with {some(others)}")

    def _left_table(self, one: LeftTable) -> str:
        """Return what a load does beyond its table."""

        def extent(ends: tuple[float, float]) -> str:
            return f"from {self._value(ends[0], one.unit)} to {self._value(ends[1], one.unit)}"

        (first, last), (low, high) = one.table, one.reached
        kept = [f"{self._value(one.kept[0], one.effort_unit)} before it"] if low < first else []
        kept += [f"{self._value(one.kept[1], one.effort_unit)} after it"] if high > last else []
        both = f"its table goes {extent(one.table)}, the motion {extent(one.reached)}"
        return f"{one.load}: {both}; it keeps {' and '.join(kept)}"

    def _lift_off(self, lift: LiftOff) -> str:
        """Return where a follower lifts off, and the tension that would hold it."""
        at = partial(self._value, unit=lift.at_unit)
        parts = listed([f"{at(begin)} to {at(end)}" for begin, end in lift.parts])
        extents = {"turn": f"at every angle of {lift.driver}", "motion": "in the whole motion"}
        where = extents.get(lift.extent, f"from {parts} of {lift.driver}")
        sign = "negative" if lift.sense > 0 else "positive"
        kind, pull = ("moment", "moment that pulls") if lift.force.endswith("moment") else ("force", "tension")
        return (
            f"{lift.joint}: the follower lifts off: contact {kind} {lift.force} {sign} {where}; "
            f"largest {pull} {self._value(lift.largest, lift.unit)} ({lift.driver} at {at(lift.at)})"
        )

    def _notes(self) -> Iterator[Verdict]:
        """Yield notes that no other verdict states, and surplus drivers that the problem does not name."""
        report = self._report
        stated = {cam.note() for cam in report.cams}
        for note in report.notes:
            if note not in stated:
                yield Verdict("poor" if note.startswith(LEAVES_RANGE) else "note", note)
        for surplus in report.mismatch.surplus if report.mismatch else ():
            if f"[drivers.{surplus.name}]" not in str(report.problem):
                by = f"{listed(surplus.implied_by)} and the joints" if surplus.implied_by else "the joints alone"
                yield Verdict("note", f"driver {surplus.name} is surplus: {by} determine what it drives")

    def _problem(self) -> Iterator[Verdict]:
        """Yield the problem and the advice."""
        if self._report.problem is not None:
            yield Verdict("problem", str(self._report.problem))
        for one in self._report.advice:
            yield Verdict("advice", f"{one.text}; leads to: {one.leads_to}", tuple(one.toml_lines()))

    # -------------------------------------------------------------------------------------------------------- tables

    def _ranges(self) -> Iterator[Table]:
        """Yield the ranges of several drivers."""
        ranges = self._report.ranges
        if len(self._report.mechanism.drivers) < 2:
            return
        rows = []
        for reach in ranges:
            ends = [self._value(end, self._at(reach.kind)) for end in reach.reach]
            ends = [
                self._value(limit.value, self._at(reach.kind)) if limit else end
                for limit, end in zip((reach.lowest, reach.highest), ends, strict=True)
            ]
            text = "turns" if reach.turns else "" if reach.stopped else self._limits(reach) if reach.limits else "none"
            rows.append((reach.driver, text, *ends))
        caption = "Range of each driver, the others at their start values"
        yield Table(("driver", "limits", "from", "to"), tuple(rows), left=2, caption=caption)

    def _loops(self) -> Iterator[Table]:
        """Yield the lengths and classes of loops and dyads."""
        rows = [self._loop(named) for named in self._report.loops] + [self._dyad(named) for named in self._report.dyads]
        columns = ("loop", f"lengths [{self._unit}]", "class", *(["detail"] if self._detail else []))
        yield Table(columns, self._first(rows), left=len(columns))

    def _first(self, rows: Sequence[tuple[str, ...]]) -> tuple[tuple[str, ...], ...]:
        """Return the first rows, and how many more there are; with details all."""
        if self._detail or len(rows) <= _MOST:
            return tuple(rows)
        return (*rows[:_MOST], (f"and {len(rows) - _MOST} more", *[""] * (len(rows[0]) - 1)))

    def _loop(self, named: NamedLoop) -> tuple[str, ...]:
        loop, kind = named.loop, named.grashof
        if isinstance(loop, FourBar):
            links: tuple[str, ...] = ("ground", *loop.links)
            lengths = [*map(self._length, loop.lengths)]
            words = [f"{kind.name} ({kind.shape})" if kind.shape else kind.name]
            words += [named.assembly] if named.assembly and "parallelogram" not in kind.shape else []
        else:
            links = (loop.crank.name, loop.rod.name)
            lengths = [*map(self._length, (loop.crank.length, loop.rod.length))]
            lengths += [f"offset {self._length(loop.offset)}"] if round(loop.offset, 9) else []
            words = ["slider-crank", kind.name.replace("nothing turns", "crank rocks")]
        shown = ", ".join(words)
        cell = Poor(shown) if kind.name == "does not close" else shown
        return (", ".join(links), ", ".join(lengths), cell, *([self._sums(named)] if self._detail else []))

    def _sums(self, named: NamedLoop) -> str:
        """Return the comparison of lengths that Grashof's class follows from."""
        loop, kind = named.loop, named.grashof
        if isinstance(loop, FourBar):
            short, long = "shortest + longest", "the others"
            short = "longest" if kind.name == "does not close" else short
        elif kind.name == "does not close":
            short, long = "offset", "crank + rod"
        else:
            shorter, long = ("crank", "rod") if loop.crank.length <= loop.rod.length else ("rod", "crank")
            short = f"{shorter} + offset"
        sign = "=" if kind.name == "change point" else "<" if kind.small < kind.large else ">"
        return f"{short} {self._number(kind.small)} {sign} {long} {self._number(kind.large)}"

    def _dyad(self, named: NamedDyad) -> tuple[str, ...]:
        dyad = named.dyad
        bodies = " and ".join(dict.fromkeys(place.body for place in (named.pins[0], *named.pins[2:])))
        is_guided = dyad.direction is not None
        links = [dyad.first] if is_guided else [dyad.first, dyad.second]
        names, lengths = listed(link.name for link in links), listed(self._length(link.length) for link in links)
        kind = f"dyad on {dyad.second.name}" if is_guided else "dyad"
        return (names, lengths, kind, *([f"between {bodies}"] if self._detail else []))

    def _angles(self) -> Iterator[Table]:
        """Yield the extremes of transmission angles."""
        angles = list(self._report_angles())
        drivers = {angle.driver for angle in angles}
        rows = []
        for angle in angles:
            is_low = angle.worst == angle.smallest
            ends = [self._value(value, "rad") for value in (angle.smallest, angle.largest)]
            if angle.verdict == "poor":
                ends = [
                    Poor(end) if is_worst else end for end, is_worst in zip(ends, (is_low, not is_low), strict=True)
                ]
            places = [self._value(u, self._at(angle.kind)) for u in (angle.at_smallest, angle.at_largest)]
            places = [f"{angle.driver} {place}" if len(drivers) > 1 else place for place in places]
            cells = (ends[0], places[0], ends[1], places[1]) if self._detail else (*ends, places[not is_low])
            rows.append((f"{angle.coupler}, {angle.output}", *cells))
        at = f"at {drivers.pop()}" if len(drivers) == 1 else "at"
        columns = ("smallest", at, "largest", at) if self._detail else ("smallest", "largest", f"worst {at}")
        yield Table(("transmission angle", *columns), self._first(rows))

    def _cam_tables(self) -> Iterator[Table]:
        """Yield the extremes of each cam."""
        for cam in self._report.cams:
            if cam.cam is not None:
                element = f"roller of radius {self._value(cam.cam.radius or 0.0, self._unit)}"
                element = element if cam.element == "roller" else cam.element
                caption = f"Cam {cam.joint}: {cam.cam.cam} moves {cam.cam.follower}, {element}".removesuffix(
                    ", unknown"
                )
                rows = [
                    (name, self._value(one.value, unit), self._value(cam.at(one.at), "rad"))
                    for name, unit, one in self._of_cam(cam)
                ]
                yield Table(("extreme", "value", f"at {cam.driver}"), tuple(rows), caption=caption)

    def _of_cam(self, cam: CamFindings) -> Iterator[tuple[str, str, CamExtreme]]:
        """Yield the name, the unit and the place of each extreme of a cam."""
        critical = cam.critical
        if critical is None:
            return
        low, high = critical.pressure
        if max(abs(low.value), abs(high.value)) >= _NONE:
            yield from (("smallest pressure angle", "rad", low), ("largest pressure angle", "rad", high))
        if not cam.is_cut:
            yield from ((f"smallest radius of curvature, {side}", self._unit, one) for side, one in cam.curvature())
        if critical.width is not None:
            ends = zip(("begins", "ends"), critical.width, strict=True)
            yield from ((f"contact on the face {word}", self._unit, one) for word, one in ends)

    def _measures(self) -> Iterator[Table]:
        measured = self._report.measured
        if measured is None:
            return
        rows = [
            (value.name, "none", "") if value.reason else (value.name, *measure_cells(value, self._digits))
            for value in measured.values
        ]
        driver = next((value.driver for value in measured.values if value.at), "")
        columns = ("measure", "value", f"at {driver}" if driver else "")
        yield Table(columns, tuple(rows), caption=f"Over {measured.over}{self._without_loads()}")

    def _force_tables(self) -> Iterator[Table]:
        loading, measured = self._report.loading, self._report.measured
        if loading is None or loading.reason:
            return
        is_known = measured is not None and measured.over == loading.over
        over = "the same motion" if is_known else loading.over + self._without_loads()
        peaks = [(peak.name, peak) for peak in (*loading.efforts, *loading.shaking)]
        if loading.reaction is not None:
            peaks.insert(len(loading.efforts), (f"largest reaction: {loading.reaction.name}", loading.reaction))
        rows = [
            (
                name,
                self._value(peak.value, peak.unit),
                self._value(peak.at, peak.at_unit),
                self._value(peak.rms, peak.unit),
            )
            if math.isfinite(peak.value)
            else (name, "no finite value", "", "")
            for name, peak in peaks
        ]
        columns = ("force", "peak", f"at {peaks[0][1].driver}" if peaks else "", "rms")
        yield Table(columns, tuple(rows), caption=f"Over {over}")
        spans = [self._span(span) for span in (*loading.inertias, *loading.loads)]
        yield Table(("range over the motion", "smallest", "largest"), self._first(spans))

    def _span(self, span: ForceRange) -> tuple[str, str, str]:
        return span.name, self._value(span.smallest, span.unit), self._value(span.largest, span.unit)

    def _without_loads(self) -> str:
        """Return ', without [loads.spring]' for the loads that the report leaves out; '' if there are none."""
        names = [name for name in self._report.left_out if name.startswith("[loads")]
        return f", without {listed(names)}" if names else ""

    # ------------------------------------------------------------------------------------------------------- details

    def _details(self) -> Iterator[tuple[str, str]]:
        """Yield subjects and texts of the equations and of their solving order."""
        report, mechanism, plan = self._report, self._report.mechanism, self._report.plan
        yield "bodies", some(body.name for body in mechanism.moving_bodies)
        rows = sum(len(joint.labels) for joint in mechanism.joints)
        yield (
            "joint rows",
            f"{rows} over {len(mechanism.coordinate_names)} coordinates; Gruebler's count {report.gruebler}",
        )
        for row in report.redundancy.dependent:
            unit = "rad" if row.row.kind == "angle" else self._unit
            others, within = listed(row.implied_by_joints), f"{row.tolerance:.3g} {unit}"
            if row in report.redundant:
                yield "redundant", f"{row.row.name}: at every pose it follows from {others}, to within {within}"
            else:
                gap = f"gap {abs(row.gap):.6g} {unit} at every pose; up to {within} would count as redundant"
                yield "contradicts", f"{row.row.name} does not close with {others}: {gap}"
        if report.mismatch and report.mismatch.missing:
            missing = report.mismatch.missing
            needed = f"{missing} more driver{'s' * (missing > 1)} needed" if report.mobility else "nothing drives"
            yield "loose", f"{some(report.mismatch.loose)}: {needed}"
        if plan is not None:
            yield "start", self._driver_values(report.starts)
            yield "assembled", self._driver_values(plan.anchor.u.tolist())
            yield "coordinates", some(plan.coordinates)
            if plan.fixed:
                yield "fixed", some(f"{name} = {value:.9g}" for name, value in plan.fixed.items())
        for k, block in enumerate(report.blocks, start=1):
            size = f"{len(block.rows)} x {len(block.unknowns)}"
            determinant = f", determinant {block.determinant}" if block.determinant else ""
            yield f"block {k}", f"{size}: {listed(block.unknowns)} from {listed(block.rows)}{determinant}"
        for reach in report.ranges:
            for limit in reach.limits:
                if limit.bodies:
                    at = f"{reach.driver} = {self._value(limit.value, self._at(reach.kind))}"
                    yield "limit", f"at {at} {some(limit.bodies)} can move while {reach.driver} is fixed"
        for toggle in report.toggles:
            yield "toggle", f"{toggle.happens} at {toggle.driver} = {self._value(toggle.value, self._at(toggle.kind))}"
        for cam in report.cams:
            if parts := [f"{part} {self._value(a, 'rad')} to {self._value(b, 'rad')}" for part, a, b in cam.program]:
                yield "program", f"of {cam.joint} over {cam.driver}: {', '.join(parts)}"
        if report.loading is not None and report.loading.gravity is not None:
            yield "gravity", f"({', '.join(map(self._number, report.loading.gravity))}) m/s2"


def _rounded(value: float, digits: int) -> str:
    return f"{float(f'{value:.{digits}g}') + 0.0:.10g}"


def value_with_unit(value: float, unit: str, digits: int) -> str:
    """Return a value with its unit; an angle in degrees."""
    if unit == "rad":
        value, unit = round(math.degrees(value), digits), "deg"
    return f"{_rounded(value, digits)} {unit}".removesuffix(" 1")


def measure_cells(value: MeasuredValue, digits: int) -> tuple[str, str]:
    """Return the value of a measure with its unit, and the driver values where it occurs."""
    places = " and ".join(value_with_unit(u, value.at_unit, digits) for u in value.at)
    return value_with_unit(value.value, value.unit, digits) + counted_from(value.type), places


def _in_line(angle: TransmissionRange) -> str:
    """Return the position of the links at a transmission angle of 0 or 180 degrees."""
    both = f"{angle.coupler} and {angle.output} fall in line"
    return f"{angle.coupler} is perpendicular to the slide" if angle.is_slide else both


def contact_text(contact: UnknownContact) -> str:
    """Return why the contact force of a cam is unknown, and which reactions have no value for this reason."""
    loaded = some(contact.reactions)
    return f"{contact.joint}: contact force unknown, {contact.reason}; without a value: {loaded}"
