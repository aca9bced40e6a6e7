"""What the engineer writes: bodies, points, joints and drivers, in Python or as a TOML file."""

from __future__ import annotations

from kinfmu.mechanism.body import Body, Gravity, Point, RunSettings, Start
from kinfmu.mechanism.mechanism import Mechanism
from kinfmu.mechanism.parameters import Parameter
from kinfmu.mechanism.settings import LawConstant

__all__ = ["Body", "Gravity", "LawConstant", "Mechanism", "Parameter", "Point", "RunSettings", "Start"]
