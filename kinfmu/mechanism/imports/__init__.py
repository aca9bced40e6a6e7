"""Mechanism files from drawings of other programs: links of PMKS+, files of Linkage, DXF sketches."""

from __future__ import annotations

from kinfmu.mechanism.imports.drawing import Imported, imported
from kinfmu.mechanism.imports.pmks import is_pmks_link
from kinfmu.mechanism.imports.sketch import UNDRIVEN, notes_of

__all__ = ["UNDRIVEN", "Imported", "imported", "is_pmks_link", "notes_of"]
