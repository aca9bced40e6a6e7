"""The motion of the drivers under efforts: steps over time, with breaks of laws and limits. Standard library only.

Python FMUs that own the motion of their drivers carry a copy of this package; `kinfmu.simulate` integrates by it, too.
"""

from __future__ import annotations

from .dormand_prince import DormandPrince
from .equation_of_motion import Course, EquationOfMotion, Given, StepEnd
from .limits import Ended
from .steps import Laws, TorqueSteps

__all__ = ["Course", "DormandPrince", "Ended", "EquationOfMotion", "Given", "Laws", "StepEnd", "TorqueSteps"]
