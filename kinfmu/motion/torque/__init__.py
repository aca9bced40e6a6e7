"""Motion of a mechanism whose drivers apply given efforts: torques and forces in place of laws of motion.

efforts: numbers, laws, functions, tables -> equation: accelerations of the drivers -> steps over time -> Run
"""

from __future__ import annotations

from kinfmu.motion.torque.torque_driven import torque_driven

__all__ = ["torque_driven"]
