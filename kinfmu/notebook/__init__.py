"""What notebooks show of mechanisms, runs, reports, designs, sensitivities and studies: pictures and tables."""

from __future__ import annotations

from kinfmu.notebook import designs, mechanism, report, run, study

__all__ = ["designs", "mechanism", "report", "run", "study"]
