"""What notebooks show of mechanisms, runs, reports, designs, sensitivities, studies and fits: pictures and tables."""

from __future__ import annotations

from kinfmu.notebook import designs, fit, mechanism, report, run, study

__all__ = ["designs", "fit", "mechanism", "report", "run", "study"]
