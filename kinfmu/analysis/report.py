"""The report of a mechanism, and `check`, which makes it."""

from __future__ import annotations

from dataclasses import replace

from kinfmu.analysis.assemblies import Assemblies, find_assemblies
from kinfmu.analysis.cams import cam_findings
from kinfmu.analysis.design_notes import motion_notes, near_pivots, part_notes, toggle_positions, unused_points
from kinfmu.analysis.doctor import improvement, is_doubtful, treatment
from kinfmu.analysis.driver_path import follow
from kinfmu.analysis.drivers import DriverMismatch, clearer_problem, driver_mismatch
from kinfmu.analysis.file_notes import file_notes, run_notes, start_notes
from kinfmu.analysis.findings import Findings
from kinfmu.analysis.loading import loading
from kinfmu.analysis.measuring import measurements
from kinfmu.analysis.singular import Matrix, driver_range, pose_matrices
from kinfmu.analysis.summary import summary
from kinfmu.analysis.transmission import find_dyads, find_named_loops
from kinfmu.display import Displayed, Summary
from kinfmu.errors import AssemblyError, InconsistentError, KinfmuError, MechanismError, MobilityError, listed
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.mechanism import require_mechanism
from kinfmu.plan import localized, plan_from
from kinfmu.plan.equations.redundancy import find_redundancy
from kinfmu.plan.equations.start_poses import open_joints_text, start_from_poses
from kinfmu.plan.equations.system import System


class Report(Findings, Displayed):
    """The findings of a check; as text of 80 columns with `str`."""

    def __repr__(self) -> str:
        problem = f"; problem: {self.problem}" if self.problem else ""
        return f"<Report on {self.mechanism.name}: mobility {self.mobility}{problem}>"

    def __str__(self) -> str:
        return self.summary().text(80)

    def summary(self, *, detail: bool = False) -> Summary:
        """Return verdicts and tables; `text(width)` of them is what `kinfmu check` prints, `html()` the same as HTML.

        Args:
            detail: With all digits, coordinates, fixed values and the solving order.

        """
        return summary(self, detail=detail)

    @property
    def has_cut_cam(self) -> bool:
        """Whether the problem is a cam that cannot be made; the mechanism still moves as its law says."""
        return self.plan is not None and any(cam.is_cut for cam in self.cams)

    def assemblies(self) -> Assemblies:
        """Return all assemblies of the mechanism at its start driver values.

        Raises:
            KinfmuError: The report's `problem`, if it is not one of the start poses.
            AssemblyError: If no assembly is found.

        """
        if self.problem is not None and not (isinstance(self.problem, AssemblyError) or self.has_cut_cam):
            raise self.problem
        return find_assemblies(self.mechanism, self.plan)

    def matrices(self) -> tuple[Matrix, ...]:
        """Return Phi_K,q and Phi_q at the assembled pose, Phi_q at each singular point and after a small turn.

        Raises:
            KinfmuError: If the mechanism has no plan.

        """
        if self.plan is None:
            raise self.problem or KinfmuError("there is no plan, so there are no matrices")
        return pose_matrices(self.plan, self.redundancy, self.range)


def check(mechanism: Mechanism, *, written: Mechanism | None = None) -> Report:
    """Check a mechanism: mobility, redundancy, plan, drivers, loops, singular points, ranges, cams, measures, forces.

    Args:
        mechanism: The mechanism to check.
        written: The mechanism as in its file, for notes on numbers that are there; default: the same. Parameters and
            law constants that are set, and the start poses that follow from them, are not in the file.

    Returns:
        The report. An error of the mechanism is not raised; it is the report's `problem`.

    """
    require_mechanism(mechanism, "check")
    notes = [*file_notes(mechanism, written), *part_notes(mechanism)]
    local, origin = localized(mechanism)
    system = System(local)
    redundancy = find_redundancy(system)
    try:
        plan = plan_from(mechanism, system, origin, redundancy)
    except KinfmuError as problem:
        if (rest := _without_load(mechanism, problem.data.get("load"))) is not None:
            return leaving_out(check(rest[0], written=written), problem, rest[1])
        notes += near_pivots(mechanism) if isinstance(problem, AssemblyError) else ()
        mismatch = driver_mismatch(system, redundancy)
        loops = find_named_loops(mechanism, redundancy, ())
        advice = tuple(treatment(mechanism, system, redundancy, problem))
        problem = _after_probable_cause(clearer_problem(problem, redundancy, mismatch), system, mismatch)
        return Report(mechanism, redundancy, problem, None, (), loops, mismatch, tuple(notes), advice=advice)
    notes += start_notes(system, redundancy.assembly.start)
    paths = []
    for number, driver in enumerate(mechanism.drivers):
        try:
            paths.append(follow(plan, number))
        except KinfmuError as reason:
            notes.append(f"{driver.name} cannot be followed alone: {reason}")
    ranges = tuple(driver_range(path) for path in paths)
    of_motion = [*run_notes(plan, ranges), *motion_notes(mechanism, paths)]
    loops = find_named_loops(mechanism, redundancy, paths)
    further = find_dyads(mechanism, redundancy, paths, loops)
    notes += of_motion
    cams = cam_findings(plan, paths)
    notes += [cam.note() for cam in cams if cam.note()]
    cut = next((problem for problem in (cam.problem() for cam in cams) if problem is not None), None)
    measured = measurements(mechanism, ranges)
    forces = loading(plan, ranges, cams)
    report = Report(mechanism, redundancy, cut, plan, ranges, loops, None, tuple(notes), measured, forces, cams)
    is_in_doubt = bool(of_motion) or is_doubtful(system, redundancy)
    toggles = toggle_positions(mechanism, paths, loops)
    advice = tuple(improvement(plan, system, redundancy)) if is_in_doubt else ()
    return replace(report, dyads=further, toggles=toggles, advice=advice)


def leaving_out(report: Report, problem: KinfmuError, left_out: tuple[str, ...]) -> Report:
    """Return the report of the valid part of a mechanism, with its problem and the entries that it leaves out."""
    left_out = (*left_out, *report.left_out)
    text = f"this report leaves out {listed(left_out)}, because of the problem"
    notes = () if report.left_out else report.notes
    return replace(report, problem=problem, notes=(*notes, text), left_out=left_out)


def _without_load(mechanism: Mechanism, name: object) -> tuple[Mechanism, tuple[str, ...]] | None:
    """Return the mechanism without a load and the measures that need it, and these entries; None without it."""
    loads = tuple(load for load in mechanism.loads if load.name != name)
    if len(loads) == len(mechanism.loads):
        return None
    left_out, kept = [f"[loads.{name}]"], []
    for reading in mechanism.measures:
        try:
            replace(mechanism, loads=loads, measures=(reading,))
            kept.append(reading)
        except MechanismError:
            left_out.append(f"[measures.{reading.name}]")
    return replace(mechanism, loads=loads, measures=tuple(kept)), tuple(left_out)


def _after_probable_cause(problem: KinfmuError, system: System, mismatch: DriverMismatch | None) -> KinfmuError:
    """Return an error of mobility after its probable cause: a joint at a wrong point, which leaves another unused."""
    if not isinstance(problem, MobilityError | InconsistentError):
        return problem
    opened = open_joints_text(system, start_from_poses(system).q)
    is_held = mismatch is not None and any(not surplus.implied_by for surplus in mismatch.surplus)
    unused = unused_points(system.mechanism, of_joints=True) if opened or is_held else ""
    causes = [f"in the start poses of the file {opened}"] if opened else []
    causes += [unused] if unused else []
    if not causes:
        return problem
    return type(problem)("; ".join([*causes, str(problem)]), **problem.data)
