"""The public names: the package imports each from where it is listed here, when it is first used."""

from kinfmu import draw as draw
from kinfmu import log as log
from kinfmu import readings as readings
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
from kinfmu.motion import MeasuredValue as MeasuredValue
from kinfmu.motion import measure as measure
from kinfmu.run import Run as Run
from kinfmu.run import Sink as Sink
from kinfmu.solver.python.status import Status as Status
from kinfmu.sweep import Designs as Designs
from kinfmu.sweep import Model as Model
from kinfmu.sweep import Sensitivities as Sensitivities
from kinfmu.sweep import compile as compile  # noqa: A004  as re.compile
from kinfmu.sweep import solve as solve

VERSION: str
__version__: str
