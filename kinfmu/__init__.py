"""kinfmu: planar kinematics, from a mechanism file to an FMU and logs that can be reviewed.

    import kinfmu

    mech = kinfmu.load("fourbar")
    run = kinfmu.solve(mech, crank_angle=[0.0, 0.5, 1.0])
    run["coupler.x"]

Names are imported when first used, so that `import kinfmu` costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kinfmu import log as log
    from kinfmu.analysis import Report as Report
    from kinfmu.analysis import check as check
    from kinfmu.drivers import Angle as Angle
    from kinfmu.drivers import ConstantSpeed as ConstantSpeed
    from kinfmu.errors import KinfmuError as KinfmuError
    from kinfmu.fmu import build as build
    from kinfmu.fmu import simulate as simulate
    from kinfmu.gallery import load as load
    from kinfmu.gallery import save as save
    from kinfmu.joints import Coordinate as Coordinate
    from kinfmu.joints import Distance as Distance
    from kinfmu.joints import Revolute as Revolute
    from kinfmu.mechanism import Body as Body
    from kinfmu.mechanism import Mechanism as Mechanism
    from kinfmu.mechanism import Point as Point
    from kinfmu.mechanism import RunSettings as RunSettings
    from kinfmu.mechanism import Start as Start
    from kinfmu.run import Run as Run
    from kinfmu.solver.status import Status as Status
    from kinfmu.sweep import solve as solve

VERSION = "0.1.0"
__version__ = VERSION

_HOME = {
    "Angle": "kinfmu.drivers",
    "Body": "kinfmu.mechanism",
    "ConstantSpeed": "kinfmu.drivers",
    "Coordinate": "kinfmu.joints",
    "Distance": "kinfmu.joints",
    "KinfmuError": "kinfmu.errors",
    "Mechanism": "kinfmu.mechanism",
    "Point": "kinfmu.mechanism",
    "Report": "kinfmu.analysis",
    "Revolute": "kinfmu.joints",
    "Run": "kinfmu.run",
    "RunSettings": "kinfmu.mechanism",
    "Start": "kinfmu.mechanism",
    "Status": "kinfmu.solver.status",
    "build": "kinfmu.fmu",
    "check": "kinfmu.analysis",
    "load": "kinfmu.gallery",
    "save": "kinfmu.gallery",
    "simulate": "kinfmu.fmu",
    "solve": "kinfmu.sweep",
}

__all__ = [
    "VERSION",
    "Angle",
    "Body",
    "ConstantSpeed",
    "Coordinate",
    "Distance",
    "KinfmuError",
    "Mechanism",
    "Point",
    "Report",
    "Revolute",
    "Run",
    "RunSettings",
    "Start",
    "Status",
    "build",
    "check",
    "load",
    "log",
    "save",
    "simulate",
    "solve",
]


def __getattr__(name: str) -> Any:
    """Import a public name from its home when it is first used."""
    if name == "log":
        return import_module("kinfmu.log")
    if name in _HOME:
        value = globals()[name] = getattr(import_module(_HOME[name]), name)
        return value
    raise AttributeError(f"module 'kinfmu' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME, "log"])
