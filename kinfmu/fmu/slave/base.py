"""What a slave takes from pythonfmu. The FMU has a module of this name that takes it from the copy inside."""

from __future__ import annotations

from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

__all__ = ["Fmi2Slave", "Fmi2Status"]
