"""kinfmu: planar kinematics, from a mechanism file to an FMU and logs.

    import kinfmu

    mech = kinfmu.load("fourbar")
    run = kinfmu.solve(mech, crank_angle=[0.0, 0.5, 1.0])
    run["coupler.x"]

Names are imported when first used, so that `import kinfmu` takes a few milliseconds.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kinfmu import draw as draw
    from kinfmu import log as log
    from kinfmu.analysis import Report as Report
    from kinfmu.analysis import check as check
    from kinfmu.drivers import AngleDriver as AngleDriver
    from kinfmu.drivers import CoordinateDriver as CoordinateDriver
    from kinfmu.drivers import DistanceDriver as DistanceDriver
    from kinfmu.drivers import RelativeAngleDriver as RelativeAngleDriver
    from kinfmu.drivers import SlideDriver as SlideDriver
    from kinfmu.errors import KinfmuError as KinfmuError
    from kinfmu.fmu import build as build
    from kinfmu.fmu import simulate as simulate
    from kinfmu.gallery import load as load
    from kinfmu.gallery import save as save
    from kinfmu.joints import Angle as Angle
    from kinfmu.joints import CamOscillating as CamOscillating
    from kinfmu.joints import CamRoller as CamRoller
    from kinfmu.joints import CamTranslating as CamTranslating
    from kinfmu.joints import Coordinate as Coordinate
    from kinfmu.joints import Coupling as Coupling
    from kinfmu.joints import Distance as Distance
    from kinfmu.joints import Fixed as Fixed
    from kinfmu.joints import Gear as Gear
    from kinfmu.joints import PointOnLine as PointOnLine
    from kinfmu.joints import RackAndPinion as RackAndPinion
    from kinfmu.joints import RelativeAngle as RelativeAngle
    from kinfmu.joints import Revolute as Revolute
    from kinfmu.joints import Translational as Translational
    from kinfmu.laws import ConstantSpeed as ConstantSpeed
    from kinfmu.laws import Cycloidal as Cycloidal
    from kinfmu.laws import External as External
    from kinfmu.laws import Harmonic as Harmonic
    from kinfmu.laws import ModifiedSine as ModifiedSine
    from kinfmu.laws import ModifiedTrapezoid as ModifiedTrapezoid
    from kinfmu.laws import MotionSequence as MotionSequence
    from kinfmu.laws import Polynomial as Polynomial
    from kinfmu.laws import Polynomial345 as Polynomial345
    from kinfmu.laws import Polynomial4567 as Polynomial4567
    from kinfmu.laws import Segment as Segment
    from kinfmu.laws import SimpleHarmonic as SimpleHarmonic
    from kinfmu.laws import Spline as Spline
    from kinfmu.measures import AngleBetween as AngleBetween
    from kinfmu.measures import CoordinateOf as CoordinateOf
    from kinfmu.measures import DistanceBetween as DistanceBetween
    from kinfmu.measures import OffsetFrom as OffsetFrom
    from kinfmu.measures import PositionAlong as PositionAlong
    from kinfmu.mechanism import Body as Body
    from kinfmu.mechanism import Mechanism as Mechanism
    from kinfmu.mechanism import Parameter as Parameter
    from kinfmu.mechanism import Point as Point
    from kinfmu.mechanism import RunSettings as RunSettings
    from kinfmu.mechanism import Start as Start
    from kinfmu.run import Run as Run
    from kinfmu.run import Sink as Sink
    from kinfmu.solver.python.status import Status as Status
    from kinfmu.sweep import solve as solve

VERSION = "0.1.0"
__version__ = VERSION

_HOME = {
    "Angle": "kinfmu.joints",
    "AngleBetween": "kinfmu.measures",
    "AngleDriver": "kinfmu.drivers",
    "Body": "kinfmu.mechanism",
    "CamOscillating": "kinfmu.joints",
    "CamRoller": "kinfmu.joints",
    "CamTranslating": "kinfmu.joints",
    "ConstantSpeed": "kinfmu.laws",
    "Coordinate": "kinfmu.joints",
    "CoordinateDriver": "kinfmu.drivers",
    "CoordinateOf": "kinfmu.measures",
    "Coupling": "kinfmu.joints",
    "Cycloidal": "kinfmu.laws",
    "Distance": "kinfmu.joints",
    "DistanceBetween": "kinfmu.measures",
    "DistanceDriver": "kinfmu.drivers",
    "External": "kinfmu.laws",
    "Fixed": "kinfmu.joints",
    "Gear": "kinfmu.joints",
    "Harmonic": "kinfmu.laws",
    "KinfmuError": "kinfmu.errors",
    "Mechanism": "kinfmu.mechanism",
    "ModifiedSine": "kinfmu.laws",
    "ModifiedTrapezoid": "kinfmu.laws",
    "MotionSequence": "kinfmu.laws",
    "OffsetFrom": "kinfmu.measures",
    "Parameter": "kinfmu.mechanism",
    "Point": "kinfmu.mechanism",
    "PointOnLine": "kinfmu.joints",
    "Polynomial": "kinfmu.laws",
    "Polynomial345": "kinfmu.laws",
    "Polynomial4567": "kinfmu.laws",
    "PositionAlong": "kinfmu.measures",
    "RackAndPinion": "kinfmu.joints",
    "RelativeAngle": "kinfmu.joints",
    "RelativeAngleDriver": "kinfmu.drivers",
    "Report": "kinfmu.analysis",
    "Revolute": "kinfmu.joints",
    "Run": "kinfmu.run",
    "RunSettings": "kinfmu.mechanism",
    "Segment": "kinfmu.laws",
    "SimpleHarmonic": "kinfmu.laws",
    "Sink": "kinfmu.run",
    "SlideDriver": "kinfmu.drivers",
    "Spline": "kinfmu.laws",
    "Start": "kinfmu.mechanism",
    "Status": "kinfmu.solver.python.status",
    "Translational": "kinfmu.joints",
    "build": "kinfmu.fmu",
    "check": "kinfmu.analysis",
    "load": "kinfmu.gallery",
    "save": "kinfmu.gallery",
    "simulate": "kinfmu.fmu",
    "solve": "kinfmu.sweep",
}

_PACKAGES = ("draw", "log")

__all__ = [
    "VERSION",
    "Angle",
    "AngleBetween",
    "AngleDriver",
    "Body",
    "CamOscillating",
    "CamRoller",
    "CamTranslating",
    "ConstantSpeed",
    "Coordinate",
    "CoordinateDriver",
    "CoordinateOf",
    "Coupling",
    "Cycloidal",
    "Distance",
    "DistanceBetween",
    "DistanceDriver",
    "External",
    "Fixed",
    "Gear",
    "Harmonic",
    "KinfmuError",
    "Mechanism",
    "ModifiedSine",
    "ModifiedTrapezoid",
    "MotionSequence",
    "OffsetFrom",
    "Parameter",
    "Point",
    "PointOnLine",
    "Polynomial",
    "Polynomial345",
    "Polynomial4567",
    "PositionAlong",
    "RackAndPinion",
    "RelativeAngle",
    "RelativeAngleDriver",
    "Report",
    "Revolute",
    "Run",
    "RunSettings",
    "Segment",
    "SimpleHarmonic",
    "Sink",
    "SlideDriver",
    "Spline",
    "Start",
    "Status",
    "Translational",
    "build",
    "check",
    "draw",
    "load",
    "log",
    "save",
    "simulate",
    "solve",
]


def __getattr__(name: str) -> Any:
    """Import a public name from its package when it is first used."""
    if name in _PACKAGES:
        return import_module(f"kinfmu.{name}")
    if name in _HOME:
        value = globals()[name] = getattr(import_module(_HOME[name]), name)
        return value
    raise AttributeError(f"module 'kinfmu' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME, *_PACKAGES])
