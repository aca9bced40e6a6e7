"""The findings of a check, also as plain data for programs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from kinfmu.analysis.cams import CamFindings
from kinfmu.analysis.design_notes import TogglePosition
from kinfmu.analysis.doctor import Advice
from kinfmu.analysis.drivers import DriverMismatch
from kinfmu.analysis.loading import Loading
from kinfmu.analysis.measuring import Measurements
from kinfmu.analysis.singular import DriverRange, SingularPoint
from kinfmu.analysis.transmission import NamedDyad, NamedLoop
from kinfmu.errors import KinfmuError
from kinfmu.mechanism import Mechanism
from kinfmu.plan import SolvePlan, determinant_formula
from kinfmu.plan.equations.redundancy import DependentRow, Redundancy


@dataclass(frozen=True)
class BlockReport:
    """A block of the plan: its unknowns, its rows, and its determinant if that is a short formula."""

    unknowns: tuple[str, ...]
    rows: tuple[str, ...]
    determinant: str | None


@dataclass(frozen=True)
class Findings:
    """What a check finds.

    problem: the error that prevents solving or making a cam, None if there is none;
    ranges: one per driver, in file order; loops: the four-bars and slider-cranks among the joints; mismatch: of
    drivers and degrees of freedom, None where they match; notes: further findings, one line each;
    measured: values of the measures, None without measures; loading: efforts and reactions, None without masses, loads;
    cams: one per cam joint; left_out: invalid entries of a file that is reported in part, such as '[drivers.crank]';
    advice: changes of the file, each tried, where the mechanism does not move as meant;
    dyads: further pairs of links that have a transmission angle; toggles: toggle positions that the run crosses.
    """

    mechanism: Mechanism
    redundancy: Redundancy
    problem: KinfmuError | None
    plan: SolvePlan | None
    ranges: tuple[DriverRange, ...] = ()
    loops: tuple[NamedLoop, ...] = ()
    mismatch: DriverMismatch | None = None
    notes: tuple[str, ...] = ()
    measured: Measurements | None = None
    loading: Loading | None = None
    cams: tuple[CamFindings, ...] = ()
    left_out: tuple[str, ...] = ()
    dyads: tuple[NamedDyad, ...] = ()
    toggles: tuple[TogglePosition, ...] = ()
    advice: tuple[Advice, ...] = ()

    @property
    def mobility(self) -> int:
        """Coordinates minus independent joint rows."""
        return self.redundancy.mobility

    @property
    def gruebler(self) -> int:
        """Mobility by Gruebler's count, which ignores redundancy: coordinates minus joint rows."""
        return len(self.mechanism.coordinate_names) - sum(len(joint.labels) for joint in self.mechanism.joints)

    @property
    def redundant(self) -> tuple[DependentRow, ...]:
        return self.redundancy.redundant

    @property
    def inconsistent(self) -> tuple[DependentRow, ...]:
        return self.redundancy.inconsistent

    @property
    def starts(self) -> tuple[float, ...]:
        """Driver values at the start of the run, from their laws [rad or length]."""
        return tuple(float(driver.law.at(self.mechanism.run.start)) for driver in self.mechanism.drivers)

    @property
    def range(self) -> DriverRange | None:
        """The range of the only driver; None if there are several, or no plan."""
        return self.ranges[0] if len(self.mechanism.drivers) == 1 and self.ranges else None

    @property
    def singular(self) -> tuple[SingularPoint, ...]:
        """Singular points on the path of each driver, the others at their start values."""
        return tuple(point for reach in self.ranges for point in reach.points)

    @property
    def blocks(self) -> tuple[BlockReport, ...]:
        """Blocks that need Newton, in solving order."""
        if self.plan is None:
            return ()
        return tuple(
            BlockReport(block.unknowns, block.row_names, determinant_formula(block, self.plan.parameter_values))
            for block in self.plan.blocks
            if block.unknowns
        )

    def as_json(self) -> dict[str, Any]:
        """Return the findings as plain data: angles in radians, lengths in the mechanism's unit, null where unknown.

        name, length_unit, bodies (names of the moving bodies), rows (of all joints), mobility, gruebler (Gruebler's
        count), drivers, coordinates (q), outputs: names; fixed: value by coordinate.
        redundant, inconsistent: name (joint), row, implied_by (joints), implied_by_rows, gap, tolerance.
        blocks: unknowns, rows, determinant (a short formula or null).
        start: driver values by name at the start of the run; assembled: those of the assembled pose.
        singular: driver, value, kind ('change point' or 'limit'), block.
        ranges: driver, kind ('angle' or 'length'), low, high, turns (after which the mechanism repeats), reach (values
        evaluated), stopped, limits: value, kind ('dead centre', 'change point', 'pole' or 'end'), bodies (that can move
        there while the driver is fixed), coordinates.
        loops: kind ('four-bar' or 'slider-crank'), links, lengths (by link; 'ground' too), offset (slider-cranks),
        class, shape, assembly (of four-bars: 'open' or 'crossed' in the assembled pose), sums, transmission: driver,
        coupler, output, smallest, at_smallest, largest, at_largest, verdict.
        dyads (pairs of links in none of the loops that have a transmission angle): links (of a guided link, it and its
        slider or guiding joint), lengths, joint (where they meet, or null), between (bodies), transmission.
        toggles (positions of links in line that the run crosses): driver, value, position (text).
        mismatch: null if drivers and degrees of freedom match, else missing (number), surplus (name, implied_by), loose
        (coordinates).
        advice (none for a sound mechanism): text, edits of the file ({"put": keys of nested tables, "value"} or
        {"remove": keys}), leads_to (what the changed mechanism does).
        measures: over (the motion, as text), values: name, type, value, unit, driver, at (driver values), at_unit,
        reason (why the value is null), refused: reason by name; null without measures.
        forces, only with masses or loads: over (the motion, as text), gravity ([x, y] in m/s2 or null), efforts,
        largest_reaction (of a joint; null if none is determined) and shaking (force and moment): name, value (the peak
        with its sign), unit, driver, at (driver value), at_unit, rms; reduced_inertias and loads (effort and length or
        angle of springs and dampers): name, smallest, largest, unit; undetermined: reactions, and rows that share their
        load; left_tables (loads beyond the tables of their laws): load, table and reached (first and last argument),
        unit, kept (first and last effort), effort_unit; lift_offs (contacts of cams that would have to pull): joint,
        force (column), sense (1 if positive values press), unit, driver, at_unit, parts (begin, end), extent ('turn' if
        it pulls at every angle of the driver, 'motion' if in the whole motion, else 'part'), largest_tension (of a
        lever the moment; value, at);
        reason (why there are no numbers), samples_without_numbers.
        cams, only of mechanisms with cams: joint, element ('roller', 'knife edge', 'flat face', 'unknown'), driver (in
        whose values `at`, begin and end are), reason (why there are no values), cam, follower, swings (true or false),
        roller_radius, program (of laws with segments: part, begin, end); value and at of smallest_pressure_angle,
        largest_pressure_angle, smallest_convex_radius and smallest_concave_radius (of the profile),
        smallest_pitch_radius, gouge (depth); undercut: begin, end; face: low and high (ends of the contact on a flat
        face); null where there is none.
        notes: text; problem: text or null. `kinfmu check --json` adds matrices and assemblies with their options.
        """
        plan, mechanism = self.plan, self.mechanism
        drivers = [driver.name for driver in mechanism.drivers]
        return {
            "name": mechanism.name,
            "length_unit": mechanism.length_unit,
            "bodies": [body.name for body in mechanism.moving_bodies],
            "rows": sum(len(joint.labels) for joint in mechanism.joints),
            "mobility": self.mobility,
            "gruebler": self.gruebler,
            "drivers": drivers,
            "redundant": [_row(row) for row in self.redundant],
            "inconsistent": [_row(row) for row in self.inconsistent],
            "coordinates": list(plan.coordinates) if plan else [],
            "outputs": list(plan.outputs) if plan else [],
            "fixed": dict(plan.fixed) if plan else {},
            "blocks": [
                {"unknowns": list(b.unknowns), "rows": list(b.rows), "determinant": b.determinant} for b in self.blocks
            ],
            "start": {d.name: u for d, u in zip(mechanism.drivers, self.starts, strict=True)} if plan else {},
            "assembled": {d.name: float(u) for d, u in zip(mechanism.drivers, plan.anchor.u, strict=True)}
            if plan
            else {},
            "singular": [
                {"driver": p.driver, "value": p.value, "kind": p.kind, "block": p.block or None} for p in self.singular
            ],
            "ranges": [reach.as_json() for reach in self.ranges],
            "loops": [loop.as_json() for loop in self.loops],
            "dyads": [dyad.as_json() for dyad in self.dyads],
            "toggles": [toggle.as_json() for toggle in self.toggles],
            "mismatch": None if self.mismatch is None else self.mismatch.as_json(),
            "advice": [one.as_json() for one in self.advice],
            "measures": None if self.measured is None else self.measured.as_json(),
            **({} if self.loading is None else {"forces": self.loading.as_json()}),
            **({"cams": [cam.as_json() for cam in self.cams]} if self.cams else {}),
            "notes": list(self.notes),
            "problem": str(self.problem) if self.problem else None,
        }


def _row(row: DependentRow) -> dict[str, Any]:
    return {
        "name": row.row.owner,
        "row": row.row.name,
        "implied_by": list(row.implied_by_joints),
        "implied_by_rows": [implying.name for implying in row.implied_by],
        "gap": row.gap,
        "tolerance": row.tolerance,
    }
