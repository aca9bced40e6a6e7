"""Answers to a page: what is drawn at the start pose, the mobility, what is missing; the full data of a page."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from kinfmu.analysis import check
from kinfmu.analysis.doctor import advice
from kinfmu.draw.scene.instant import Instant
from kinfmu.errors import KinfmuError, MobilityError
from kinfmu.mechanism.imports import UNDRIVEN, notes_of
from kinfmu.mechanism.quantities.placement import body_of
from kinfmu.page.describe import drawn
from kinfmu.page.editor.drawing import AS_DRAWN, PLACEHOLDER, Drawing
from kinfmu.page.html import page_data
from kinfmu.plan import require_solvable
from kinfmu.plan.equations.assembly import SINGULAR
from kinfmu.plan.equations.redundancy import Redundancy

Finding = dict[str, Any]  # a line, or a change that helps: its text, and "edits" or "operations"

_LARGE = 60  # coordinates
_MOST_EDITS = 3  # that are offered for a problem
_MOST_NOTES = 5  # of one kind in an answer
_NEXT_TO = 0.05  # of the size; points without joints that are nearer belong in one place


def answer(drawing: Drawing) -> dict[str, Any]:
    """Return the answer to a page after a change: the text, and what of it needs no run."""
    problem = _problem(drawing)
    badge = _badge(drawing, problem)
    return {
        "name": drawing.mechanism.name,
        "text": drawing.text,
        "badge": badge,
        "findings": _findings(drawing, problem) + _import_notes(drawing),
        "sketch": sketch(drawing),
        "view": None,
        "isViewComing": badge["isComplete"] or (problem is not None and drawing.has_bodies),
    }


def sketch(drawing: Drawing) -> dict[str, Any]:
    """Return what is drawn at the start pose, with the keys of the data of a page; nothing of it needs a solution."""
    mechanism, poses = drawing.mechanism, drawing.poses
    rows = {name: np.array([pose]) for name, pose in poses.items()}
    found = drawn(Instant(mechanism, rows, {driver.name: 1.0 for driver in mechanism.drivers}))
    for body in found["bodies"]:
        body["pose"] = list(poses[body["name"]])
    for point in found["points"]:
        point["at"] = list(drawing.at(f"{point['body']}.{point['name']}"))
    if not drawing.has_bodies:
        found["bodies"] = [body for body in found["bodies"] if body["name"] != PLACEHOLDER]
        found["shapes"] = [shape for shape in found["shapes"] if shape["frame"] != PLACEHOLDER]
    places = np.array([point["at"] for point in found["points"]]).reshape(-1, 2)
    box = [places.min(axis=0).tolist(), places.max(axis=0).tolist()] if len(places) else None
    return found | {
        "box": box,
        "over": None,
        "samples": None,
        "modules": None,
        "file": None,
        "closedNumbers": 0,
        "size": drawing.size,
    }


def _problem(drawing: Drawing) -> KinfmuError | None:
    """Return why a drawing cannot be solved; None if it can, and if only `view` can say it in time."""
    if _is_singular(drawing):
        return None
    problem = _problem_with(drawing, drawing.redundancy)
    if problem is None or not isinstance(drawing.redundancy, Redundancy):
        return problem
    is_matched = drawing.redundancy.mobility == len(drawing.mechanism.drivers)
    return _problem_with(drawing, drawing.assembled) if is_matched else problem  # a start pose may be singular


def _is_singular(drawing: Drawing) -> bool:
    """Return whether a large drawing is drawn in a singular pose: looking for a way out of it takes long."""
    redundancy = drawing.redundancy
    if not isinstance(redundancy, Redundancy) or len(drawing.system.coordinates) <= _LARGE:
        return False
    pose = redundancy.assembly.pose
    return redundancy.mobility == len(drawing.mechanism.drivers) > 0 and pose is not None and pose.margin <= SINGULAR


def _problem_with(drawing: Drawing, redundancy: Redundancy | KinfmuError) -> KinfmuError | None:
    if not isinstance(redundancy, Redundancy):
        return redundancy
    try:
        require_solvable(drawing.system, redundancy)
    except KinfmuError as problem:
        return problem
    return None


def _badge(drawing: Drawing, problem: KinfmuError | None) -> dict[str, Any]:
    """Return the mobility, the number of drivers, and a line on what is missing."""
    drivers = len(drawing.mechanism.drivers)
    redundancy = drawing.redundancy
    if not drawing.has_bodies:
        return {"mobility": 0, "drivers": 0, "text": "nothing drawn yet", "isComplete": False}
    if not isinstance(redundancy, Redundancy):
        return {"mobility": None, "drivers": drivers, "text": "cannot be solved", "isComplete": False}
    mobility = redundancy.mobility
    missing = mobility - drivers
    if missing > 0:
        text = f"{missing} more joint{'s'[: missing > 1]} or driver{'s'[: missing > 1]}"
    elif missing < 0:
        text = f"{-missing} driver{'s'[: missing < -1]} too many"
    elif not drivers:
        text = "a structure: nothing moves"
    elif _is_singular(drawing):
        text = "complete, in a singular pose"
    elif problem is None:
        text = "complete"
    else:
        text = "does not close" if not isinstance(problem, MobilityError) else "the drivers do not determine the motion"
    return {"mobility": mobility, "drivers": drivers, "text": text, "isComplete": problem is None and drivers > 0}


def _findings(drawing: Drawing, problem: KinfmuError | None, advised: Iterable[Finding] = ()) -> list[Finding]:
    """Return lines on what is missing, with operations that would help; advised: those that were tried."""
    if not drawing.has_bodies or problem is None:
        return []
    unpinned = _unpinned(drawing)
    edits = [edit for one in unpinned for edit in one["edits"]]  # what is left open by mistake comes first
    pins = [{*edit["operations"][0]["points"]} for edit in edits]
    edits += [edit for edit in (*advised, *_help(drawing)) if not any(_is_pin(edit, points) for points in pins)]
    redundancy = drawing.redundancy
    is_open = isinstance(redundancy, Redundancy) and redundancy.mobility > len(drawing.mechanism.drivers)
    text = str(problem).removeprefix("[drivers] ")  # a page has no tables
    return [{"kind": "open" if is_open else "problem", "text": text, "edits": edits[:_MOST_EDITS]}, *unpinned]


def _is_pin(edit: Finding, points: set[str]) -> bool:
    """Return whether what an edit does is only to pin points together."""
    changes = edit["operations"][0].get("edits", [])
    value = changes[0].get("value") if len(changes) == 1 else None
    return isinstance(value, dict) and {*value.get("between", ())} == points


def _unpinned(drawing: Drawing) -> list[Finding]:
    """Return a line for each place where points of two bodies meet that no joint holds together."""
    held = {frozenset(map(body_of, joint.between)) for joint in drawing.mechanism.joints if hasattr(joint, "between")}
    points = [*drawing.mechanism.body_points]
    places = np.array([drawing.at(point) for point in points]).reshape(-1, 2)
    near = cKDTree(places).query_pairs(_NEXT_TO * drawing.size) if points else ()
    found = []
    for apart, k, j in sorted((math.dist(places[k], places[j]), k, j) for k, j in near):
        a, b = points[k], points[j]
        is_open = max(len(drawing.pins[a]), len(drawing.pins[b])) == 1  # what is pinned nearby may belong there
        if body_of(a) == body_of(b) or b in drawing.pins[a] or frozenset((body_of(a), body_of(b))) in held:
            continue
        if apart <= AS_DRAWN * drawing.size or is_open:
            where = (
                "in one place"
                if apart <= AS_DRAWN * drawing.size
                else f"{apart:.2g} {drawing.mechanism.length_unit} apart"
            )
            pin = {"text": f"pin {a} and {b}", "operations": [{"do": "pin", "points": [a, b]}]}
            found.append({"kind": "note", "text": f"{a} and {b} are {where} and not joined", "edits": [pin]})
    return found[:_MOST_NOTES]


def _help(drawing: Drawing) -> list[Finding]:
    """Return operations that may complete a drawing: motors of bodies that are pinned to the ground."""
    redundancy, mechanism = drawing.redundancy, drawing.mechanism
    if not isinstance(redundancy, Redundancy) or redundancy.mobility <= len(mechanism.drivers):
        return []
    driven = {body for driver in mechanism.drivers for body in driver.bodies()}
    return [
        {"text": f"add a motor to {body}", "operations": [{"do": "motor", "body": body}]}
        for body in drawing.pinned_to("ground")
        if body not in driven
    ]


def view(drawing: Drawing) -> dict[str, Any]:
    """Return the data of the page of a drawing and the findings of its check.

    A drawing that cannot be solved has no such data; its problem comes with changes that were tried.

    Raises:
        KinfmuError: It is too large for a page.

    """
    report = check(drawing.mechanism)
    notes = _import_notes(drawing) + _notes(report.notes)
    advised = _advised(drawing) if report.problem is not None else []
    findings = _findings(drawing, report.problem, advised) + notes
    is_stuck = report.problem is not None and report.plan is None
    return {"view": None if is_stuck else page_data(drawing.mechanism, report), "findings": findings}


def _import_notes(drawing: Drawing) -> list[Finding]:
    """Return lines on what an import has left out or chosen, as long as the file has them."""
    return _notes(f"import: {line}" for line in notes_of(drawing.text) if line != UNDRIVEN)


def _notes(lines: Iterable[str]) -> list[Finding]:
    return [{"kind": "note", "text": line, "edits": []} for line in lines]


def _advised(drawing: Drawing) -> list[Finding]:
    """Return changes after which a drawing moves, as operations."""
    return [
        {"text": f"{one.text}: {one.leads_to}", "operations": [{"do": "edit", "edits": one.as_json()["edits"]}]}
        for one in advice(tomllib.loads(drawing.text))
    ]
