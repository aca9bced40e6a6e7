"""What the engineer writes: bodies, points, joints and drivers, in Python or as a TOML file."""

from __future__ import annotations

from kinfmu.mechanism.body import Body, Point, Start
from kinfmu.mechanism.law_constant import LawConstant
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.mechanism.parameters import Parameter
from kinfmu.mechanism.run_settings import RunSettings

__all__ = ["Body", "LawConstant", "Mechanism", "Parameter", "Point", "RunSettings", "Start"]
