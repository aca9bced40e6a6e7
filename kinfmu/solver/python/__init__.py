"""Run time in Python: advance along the branch, Newton, bridges over singular points. Standard library only.

This package is copied into the Python FMU as it is, beside the generated model.
"""

from __future__ import annotations

from .continuation import UnsolvableModel, with_parameters
from .pose import Pose
from .solver import Solver
from .status import Status

__all__ = ["Pose", "Solver", "Status", "UnsolvableModel", "with_parameters"]
