"""The findings of a check as plain data for programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from kinfmu.analysis.loops import FourBar
from kinfmu.analysis.singular import DriverRange, LimitPosition
from kinfmu.equations.redundancy import DependentRow

if TYPE_CHECKING:
    from kinfmu.analysis.drivers import DriverAdvice
    from kinfmu.analysis.named_loops import NamedLoop
    from kinfmu.analysis.report import Report


def as_json(report: Report) -> dict[str, Any]:
    """Return the findings as plain data. Angles in radians, lengths in the mechanism's unit; unknown values are null.

    name, length_unit, bodies (names of the moving bodies), rows (of all joints), mobility, gruebler (Gruebler's count),
    drivers, coordinates (q), outputs: names; fixed: value by coordinate.
    redundant, inconsistent: name (joint), row, implied_by (joints), implied_by_rows, gap, tolerance.
    blocks: unknowns, rows, determinant (a short formula or null).
    start: driver values by name at the start of the run; assembled: those of the assembled pose.
    singular: driver, value, kind ('change point' or 'limit'), block.
    ranges: driver, kind ('angle' or 'length'), low, high, turns (after which the mechanism repeats), reach (values
    evaluated), stopped, limits: value, kind ('dead centre', 'change point' or 'end'), bodies (that can move there
    while the driver is fixed), coordinates.
    loops: kind ('four-bar' or 'slider-crank'), links, lengths (by link; 'ground' too), offset (slider-cranks), class,
    shape, sums, transmission: driver, coupler, output, smallest, at_smallest, largest, at_largest, verdict.
    advice: null if drivers and degrees of freedom match, else missing (number), surplus (name, implied_by), loose
    (coordinates), suggestions (name, and the keys of the driver's table).
    notes: text; problem: text or null. `kinfmu check --json` adds matrices and assemblies with their options.
    """
    plan, mechanism = report.plan, report.mechanism
    return {
        "name": mechanism.name,
        "length_unit": mechanism.length_unit,
        "bodies": [body.name for body in mechanism.moving_bodies],
        "rows": sum(len(joint.labels) for joint in mechanism.joints),
        "mobility": report.mobility,
        "gruebler": report.gruebler,
        "drivers": [driver.name for driver in mechanism.drivers],
        "redundant": [_row(row) for row in report.redundant],
        "inconsistent": [_row(row) for row in report.inconsistent],
        "coordinates": list(plan.coordinates) if plan else [],
        "outputs": list(plan.outputs) if plan else [],
        "fixed": dict(plan.fixed) if plan else {},
        "blocks": [
            {"unknowns": list(b.unknowns), "rows": list(b.rows), "determinant": b.determinant} for b in report.blocks
        ],
        "start": {d.name: u for d, u in zip(mechanism.drivers, report.starts, strict=True)} if plan else {},
        "assembled": {d.name: float(u) for d, u in zip(mechanism.drivers, plan.anchor.u, strict=True)} if plan else {},
        "singular": [
            {"driver": p.driver, "value": p.value, "kind": p.kind, "block": p.block or None} for p in report.singular
        ],
        "ranges": [_range(reach) for reach in report.ranges],
        "loops": [_loop(named) for named in report.loops],
        "advice": None if report.advice is None else _advice(report.advice),
        "notes": list(report.notes),
        "problem": str(report.problem) if report.problem else None,
    }


def _row(row: DependentRow) -> dict[str, Any]:
    return {
        "name": row.row.owner,
        "row": row.row.name,
        "implied_by": list(row.implied_by_joints),
        "implied_by_rows": list(row.implied_by),
        "gap": row.gap,
        "tolerance": row.tolerance,
    }


def _range(reach: DriverRange) -> dict[str, Any]:
    return {
        "driver": reach.driver,
        "kind": reach.kind,
        "low": reach.low,
        "high": reach.high,
        "turns": reach.turns,
        "reach": list(reach.reach),
        "stopped": reach.stopped,
        "limits": [_limit(limit) for limit in (reach.lowest, reach.highest) if limit is not None],
    }


def _limit(limit: LimitPosition) -> dict[str, Any]:
    return {
        "value": limit.value,
        "kind": limit.kind,
        "bodies": list(limit.bodies),
        "coordinates": dict(limit.coordinates),
    }


def _loop(named: NamedLoop) -> dict[str, Any]:
    loop, kind = named.loop, named.grashof
    data: dict[str, Any] = {"kind": "four-bar" if isinstance(loop, FourBar) else "slider-crank"}
    data["links"] = list(loop.links)
    if isinstance(loop, FourBar):
        data["lengths"] = dict(zip(("ground", *loop.links), loop.lengths, strict=True))
    else:
        data["lengths"] = {loop.crank.name: loop.crank.length, loop.rod.name: loop.rod.length}
        data["offset"] = loop.offset
    data |= {"class": kind.name, "shape": kind.shape or None, "sums": [kind.small, kind.large]}
    data["transmission"] = [
        {
            "driver": angle.driver,
            "coupler": angle.coupler,
            "output": angle.output,
            "smallest": angle.smallest,
            "at_smallest": angle.at_smallest,
            "largest": angle.largest,
            "at_largest": angle.at_largest,
            "verdict": angle.verdict,
        }
        for angle in named.transmission
    ]
    return data


def _advice(advice: DriverAdvice) -> dict[str, Any]:
    return {
        "missing": advice.missing,
        "surplus": [{"name": s.name, "implied_by": list(s.implied_by)} for s in advice.surplus],
        "loose": list(advice.loose),
        "suggestions": [{"name": s.name, "keys": s.keys} for s in advice.suggestions],
    }
