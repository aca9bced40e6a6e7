"""Message definitions of ROS 2 that viewers draw by themselves, and a robot description made of a scene.

Text of the definitions: common_interfaces, geometry2 and rcl_interfaces (Apache-2.0 / BSD-3), without comments.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from xml.sax.saxutils import quoteattr

import numpy as np

from kinfmu.joints import Distance
from kinfmu.joints.placement import body_of
from kinfmu.log.scene import Scene
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.run import FloatArray, Run
from kinfmu.shapes import palette
from kinfmu.shapes.placing import poses_of, world

_LINE = "=" * 80
_TIME = f"{_LINE}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
_HEADER = f"{_LINE}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n{_TIME}"

STRING = "string data\n"
JOINT_STATE = (
    f"std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n{_HEADER}"
)
TF_MESSAGE = (
    "geometry_msgs/TransformStamped[] transforms\n"
    f"{_LINE}\nMSG: geometry_msgs/TransformStamped\n"
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"
    f"{_LINE}\nMSG: geometry_msgs/Transform\n"
    "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"
    f"{_LINE}\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
    f"{_LINE}\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n{_HEADER}"
)
LOG = (
    "byte DEBUG=10\nbyte INFO=20\nbyte WARN=30\nbyte ERROR=40\nbyte FATAL=50\n"
    "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring function\nuint32 line\n"
    f"{_TIME}"
)
LOG_LEVELS = {"info": 20, "warning": 30, "error": 40}
ROOT = "ground"  # the frame that everything stands in


def sample_definition(fields: Iterable[tuple[str, str, str]]) -> str:
    """Definition of kinfmu_msgs/msg/Sample: a stamp, then one field a column; fields: (type, name, comment)."""
    lines = [f"{kind} {name}  # {comment}" for kind, name, comment in fields]
    return "builtin_interfaces/Time stamp\n" + "\n".join(lines) + f"\n{_TIME}"


def field_names(columns: Iterable[str]) -> list[str]:
    """Names as ROS 2 allows them, 'coupler_x' of 'coupler.x': lower case, single underscores, all different."""
    names: list[str] = []
    for column in columns:
        name = re.sub(r"[^a-z0-9]+", "_", column.lower()).strip("_") or "column"
        name = name if name[0].isalpha() else f"n{name}"
        taken, number = name, 2
        while taken in names:
            taken, number = f"{name}_{number}", number + 1
        names.append(taken)
    return names


def frames(run: Run, mechanism: Mechanism) -> dict[str, FloatArray]:
    """Pose (n, 3) of x, y [length], phi [rad] of every link of the robot description: bodies, then bars."""
    poses, _ = poses_of(run, mechanism)
    placed = {body.name: poses[body.name] for body in mechanism.moving_bodies if body.name in poses}
    points = mechanism.body_points
    for joint in mechanism.joints:
        if isinstance(joint, Distance):
            bodies = [body_of(point) for point in joint.between]
            if all(body in poses or body == GROUND_NAME for body in bodies):
                a, b = (
                    np.broadcast_to(points[point], (len(run), 2))
                    if body == GROUND_NAME
                    else world(poses[body], points[point])
                    for body, point in zip(bodies, joint.between, strict=True)
                )
                placed[_bar_frame(joint.name)] = np.column_stack([a, np.arctan2(b[:, 1] - a[:, 1], b[:, 0] - a[:, 0])])
    return placed


def robot_description(name: str, scene: Scene, metres: float) -> str:
    """URDF of the scene: every link under ROOT by a floating joint, so that closed loops need no tree.

    metres: length of the mechanism's unit [m]. Links lie in layers above each other so that none hides another.
    """
    width = 0.02 * scene.size * metres
    links = [_link(ROOT, palette.GROUND, [np.array([point]) for point in scene.supports.values()], width, 0.0, metres)]
    links += [
        _link(body.name, palette.body(body.index), [body.outline], width, width * (1 + body.index), metres)
        for body in scene.bodies
    ]
    for bar in scene.bars:
        ends = np.array([[0.0, 0.0], [bar.length, 0.0]])
        links.append(_link(_bar_frame(bar.name), palette.BAR, [ends], 0.6 * width, -width, metres))
    joints = [
        f'<joint name={quoteattr(link + "_floats")} type="floating">'
        f"<parent link={quoteattr(ROOT)}/><child link={quoteattr(link)}/></joint>"
        for link in (*(body.name for body in scene.bodies), *(_bar_frame(bar.name) for bar in scene.bars))
    ]
    body_lines = "\n".join([*links, *joints])
    return f'<?xml version="1.0"?>\n<robot name={quoteattr(name)}>\n{body_lines}\n</robot>\n'


def _bar_frame(joint: str) -> str:
    return f"bar.{joint}"  # names of bodies hold no dot


def _link(
    name: str, colour: palette.Colour, strips: Iterable[FloatArray], width: float, height: float, metres: float
) -> str:
    """A link of boxes along its polylines and discs at their corners; width, height [m], strips in the unit."""
    rgba = " ".join(f"{channel / 255:.3g}" for channel in colour)
    material = f'<material name={quoteattr(name)}><color rgba="{rgba} 1"/></material>'
    visuals = []
    for strip in strips:
        for start, end in zip(metres * strip[:-1], metres * strip[1:], strict=True):
            (x, y), (dx, dy) = (start + end) / 2, end - start
            visuals.append(
                f'<visual><origin xyz="{x:.9g} {y:.9g} {height:.9g}" rpy="0 0 {np.arctan2(dy, dx):.9g}"/>'
                f'<geometry><box size="{np.hypot(dx, dy):.9g} {width:.9g} {width:.9g}"/></geometry>{material}</visual>'
            )
        for x, y in metres * np.unique(strip, axis=0):
            visuals.append(
                f'<visual><origin xyz="{x:.9g} {y:.9g} {height:.9g}" rpy="0 0 0"/>'
                f'<geometry><cylinder radius="{width:.9g}" length="{1.2 * width:.9g}"/></geometry>{material}</visual>'
            )
    return f"<link name={quoteattr(name)}>{''.join(visuals)}</link>"
