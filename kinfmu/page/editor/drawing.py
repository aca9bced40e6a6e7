"""A mechanism as it is drawn: the text of its file, and the poses of its bodies at the start, as far as they close."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import KinfmuError, MechanismError, suggestion
from kinfmu.mechanism import Mechanism, Point
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.edits import Edit, Put
from kinfmu.mechanism.joints import Revolute
from kinfmu.mechanism.quantities.placement import BodyFrame, Placement, body_of, unit_vector
from kinfmu.mechanism.repeats import expanded
from kinfmu.mechanism.toml_document import LARGEST_FILE, document_of, text_in
from kinfmu.mechanism.toml_file import mechanism_of
from kinfmu.mechanism.valid import quoted
from kinfmu.page.editor.text_edits import edited_text
from kinfmu.plan import localized
from kinfmu.plan.equations.assembly import MOST_DENSE, closed_start
from kinfmu.plan.equations.closing import CLOSED, close, closed_up_to, followed
from kinfmu.plan.equations.part import Part
from kinfmu.plan.equations.redundancy import Redundancy, find_redundancy
from kinfmu.plan.equations.start_poses import is_in_world_coordinates, law_targets, start_from_poses
from kinfmu.plan.equations.system import System

AS_DRAWN = 1e-9  # of the size; start poses that close this well are the drawn poses, to the bit
_STEPS = 10  # on the way of a driver
_CORRECTIONS = 20  # iterations after a step; a pose that needs more is at the end of the way
PLACEHOLDER = "_"  # stands for the bodies of a file that has only the ground, which is no mechanism yet

Pose = tuple[float, float, float]
Spot = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Drawing:
    """The text of a mechanism file that may be drawn in part only.

    Attributes:
        text: The text of the file.
        folder: Where relative paths of files in it start.
        document: The tables of the text.
        mechanism: Its mechanism; that of a file with only the ground has one body without points, `PLACEHOLDER`.

    """

    text: str
    folder: Path
    document: Mapping[str, Any]
    mechanism: Mechanism

    @classmethod
    def of(cls, text: str, folder: Path) -> Drawing:
        """Return the drawing of a text.

        Raises:
            MechanismError: It is not TOML, or something in it is invalid.

        """
        if len(text) > LARGEST_FILE:
            raise MechanismError(f"the file would be too large for a mechanism (largest: {LARGEST_FILE} characters)")
        try:
            text.encode()
        except UnicodeEncodeError:
            raise MechanismError("the text has characters that no file can hold") from None
        document = document_of(text, "the text")
        bodies = expanded(document).get("bodies", {})
        shown: dict[str, Any] = document
        if isinstance(bodies, Mapping) and not bodies.keys() - {GROUND_NAME}:
            shown = document | {"bodies": {**document.get("bodies", {}), PLACEHOLDER: {}}}
        return cls(text, folder, document, mechanism_of(shown, folder))

    @classmethod
    def read(cls, path: Path) -> Drawing:
        """Return the drawing of a file.

        Raises:
            MechanismError: The file cannot be read, or something in it is invalid.

        """
        return cls.of(text_in(path, "a mechanism file"), path.parent)

    def with_edits(self, edits: Iterable[Edit]) -> Drawing:
        """Return the drawing after edits of its text.

        Raises:
            MechanismError: An edit is not possible, or its result is invalid.

        """
        return Drawing.of(edited_text(self.text, self.document, edits), self.folder)

    def started_at(self, poses: Mapping[str, Pose]) -> Drawing:
        """Return the drawing with start poses in its file for the bodies that are elsewhere than in these poses."""
        allowed = AS_DRAWN * max(1.0, self.size)
        bodies = self.document.get("bodies", {})
        edits = [
            Put(("bodies", name, "start"), _start_table(poses[name]))
            for name, pose in self.poses.items()
            if name in poses and name in bodies and math.dist(pose, poses[name]) > allowed
        ]
        return self.with_edits(edits) if edits else self

    def started_as_drawn(self) -> Drawing:
        """Return the drawing with the drawn poses as start poses, if its points are in coordinates of the world."""
        if not is_in_world_coordinates(self.mechanism) or not any(map(any, self.poses.values())):
            return self
        moved = ((name, pose) for name, pose in self.poses.items() if any(pose) and name in self.document["bodies"])
        return self.with_edits(Put(("bodies", name, "start"), _start_table(pose)) for name, pose in moved)

    @property
    def has_bodies(self) -> bool:
        """True if there is a body that can move."""
        return self.mechanism.moving_bodies[0].name != PLACEHOLDER

    @cached_property
    def system(self) -> System:
        """The equations, relative to `origin`."""
        return System(self._local[0])

    @property
    def origin(self) -> Point:
        """The place in the world of the origin of `system`."""
        return self._local[1]

    @cached_property
    def _local(self) -> tuple[Mechanism, Point]:
        return localized(self.mechanism)

    @cached_property
    def _start(self) -> FloatArray | None:
        """The start pose of the file, all coordinates (n,), if all joints and drivers are closed there."""
        system, start, law = self.system, start_from_poses(self.system).q, law_targets(self.system)
        open_by = np.abs(system.residual(start, law) / system.scales) if system.rows else np.zeros(1)
        return start if np.max(open_by) <= AS_DRAWN * system.size else None

    @cached_property
    def redundancy(self) -> Redundancy | KinfmuError:
        """The mobility, of the start pose if it is closed, else assembled; or why it is not known."""
        if self._start is None or len(self._start) > MOST_DENSE:
            return self.assembled
        try:
            return find_redundancy(self.system, closed_start(self.system, self._start, law_targets(self.system)))
        except KinfmuError as problem:
            return problem

    @cached_property
    def assembled(self) -> Redundancy | KinfmuError:
        """The mobility with the assembled start pose, which may be next to a singular one; or why it is not known."""
        try:
            return find_redundancy(self.system)
        except KinfmuError as problem:
            return problem

    @cached_property
    def poses(self) -> dict[str, Pose]:
        """The drawn poses x, y [length], phi [rad] of all bodies: the start poses, closed as far as possible."""
        x, y = self.origin
        rows = (self._drawn.reshape(-1, 3) + np.array([x, y, 0.0])).tolist()
        poses = {body.name: tuple(row) for body, row in zip(self.mechanism.moving_bodies, rows, strict=True)}
        return {GROUND_NAME: (0.0, 0.0, 0.0), **poses}

    @property
    def _drawn(self) -> FloatArray:
        """All coordinates of the drawn poses, (n,)."""
        if self._start is not None:
            return self._start
        system, law = self.system, law_targets(self.system)
        pose = self.redundancy.assembly.pose if isinstance(self.redundancy, Redundancy) else None
        if pose is not None:
            if np.array_equal(pose.u, law):
                return pose.q
            q, u = followed(system, pose.q, pose.u, law)
            return q if np.array_equal(u, law) else pose.q
        start = start_from_poses(system).q
        try:
            q, gap = close(Part(system, range(system.joint_row_count)), start, law)
        except KinfmuError:
            return start
        return q if gap <= CLOSED else start

    def reached(self, driver: str, value: float) -> float:
        """Return how far a driver gets from the drawn pose on its way to a value, in steps, with the others at rest."""
        u, q = law_targets(self.system), self._drawn
        number = [one.name for one in self.mechanism.drivers].index(driver)
        begin = last = float(u[number])
        for step in range(1, _STEPS + 1):
            u[number] = begin + step / _STEPS * (value - begin)
            q, gap = close(self.system, q, u, _CORRECTIONS)
            if gap > closed_up_to(self.system):
                break
            last = float(u[number])
        return last

    @cached_property
    def placement(self) -> Placement:
        """The drawn poses as joints see them."""
        frames = {name: BodyFrame(x, y, phi, *unit_vector(phi)) for name, (x, y, phi) in self.poses.items()}
        return Placement(frames, self.mechanism.body_points)

    def at(self, point: str) -> Spot:
        """Return the place in the world of 'body.point' as drawn."""
        x, y = self.placement.point(point)
        return float(x), float(y)

    def seen_from(self, body: str, spot: Spot) -> Spot:
        """Return the coordinates in the frame of a body of a place in the world."""
        frame = self.placement.poses[body]
        d_x, d_y = spot[0] - frame.x, spot[1] - frame.y
        return frame.c * d_x + frame.s * d_y, frame.c * d_y - frame.s * d_x

    @cached_property
    def pins(self) -> dict[str, frozenset[str]]:
        """All points that revolute joints hold together with a point, itself included, by 'body.point'."""
        groups: dict[str, frozenset[str]] = {point: frozenset([point]) for point in self.mechanism.body_points}
        for joint in self.mechanism.joints:
            if isinstance(joint, Revolute):
                a, b = joint.between
                whole = groups[a] | groups[b]
                groups |= dict.fromkeys(whole, whole)
        return groups

    @cached_property
    def size(self) -> float:
        """The extent of all points as drawn, at least that of a system without any [length]."""
        places = np.array([self.at(point) for point in self.mechanism.body_points]).reshape(-1, 2)
        extent = float(np.hypot(*np.ptp(places, axis=0))) if len(places) else 0.0
        return extent or self.system.size

    def point(self, point: str, where: str) -> str:
        """Return 'body.point', if there is one; where: in messages.

        Raises:
            MechanismError: There is no such point.

        """
        known = self.mechanism.body_points
        if point not in known:
            raise MechanismError(f"{where}: there is no point {quoted(point)}{suggestion(point, known)}")
        return point

    def pinned_to(self, body: str) -> dict[str, str]:
        """Return the bodies that are pinned to a body, each with the point of that body at its first pin."""
        found: dict[str, str] = {}
        for joint in self.mechanism.joints:
            if isinstance(joint, Revolute) and body in joint.bodies():
                own, other = sorted(joint.between, key=lambda point: body_of(point) != body)
                found.setdefault(body_of(other), own)
        return found


def _start_table(pose: Pose) -> dict[str, Any]:
    x, y, phi = pose
    return {"x": written_number(x), "y": written_number(y), "phi": written_angle(phi)}


def new_text(name: str) -> str:
    """Return the text of a file in which nothing is drawn yet; name: of the mechanism, made valid."""
    valid = re.sub(r"\W", "_", name, flags=re.ASCII)[:100] or "mechanism"
    valid = valid if not valid[0].isdigit() else f"_{valid}"[:100]
    return f'name = "{valid}"\n\n[units]\nlength = "mm"\n\n[bodies.ground]\npoints = {{}}\n'


def written_number(value: float) -> float | int:
    """Return a number as it is written: with at most 15 digits, a whole number without a point."""
    value = float(f"{value:.15g}")
    return int(value) if value == int(value) and abs(value) < 1e15 else value


def written_angle(angle: float) -> str:
    """Return an angle [rad] as it is written, in degrees."""
    degrees = float(f"{math.degrees(angle):.12g}")
    return f"{written_number(degrees)} deg"
