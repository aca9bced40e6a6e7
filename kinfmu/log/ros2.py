"""Definitions of the ROS 2 messages that viewers draw without set-up, and field names that ROS 2 allows.

Source of the definitions: common_interfaces, geometry2 and rcl_interfaces (Apache-2.0 / BSD-3), without comments.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

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
ROOT = "ground"  # the root frame


def sample_definition(fields: Iterable[tuple[str, str, str]]) -> str:
    """Return the definition of kinfmu_msgs/msg/Sample: a stamp, then one field per column.

    fields: (type, name, comment) of each.
    """
    lines = [f"{kind} {name}  # {comment}" for kind, name, comment in fields]
    return "builtin_interfaces/Time stamp\n" + "\n".join(lines) + f"\n{_TIME}"


def field_names(columns: Iterable[str]) -> list[str]:
    """Return names that ROS 2 allows, 'coupler_x' for 'coupler.x': lower case, single underscores, all different."""
    names: list[str] = []
    for column in columns:
        name = re.sub(r"[^a-z0-9]+", "_", column.lower()).strip("_") or "column"
        name = name if name[0].isalpha() else f"n{name}"
        taken, number = name, 2
        while taken in names:
            taken, number = f"{name}_{number}", number + 1
        names.append(taken)
    return names
