"""Run time in Python: advance along the branch, Newton, bridges over singular points. Standard library only.

The Python FMU carries a copy of this package, in which the generated model is one more module.
"""

from __future__ import annotations

from .continuation import UnsolvableModel, with_parameters
from .pose import Pose, Status
from .solver import Solver

__all__ = ["Pose", "Solver", "Status", "UnsolvableModel", "with_parameters"]
