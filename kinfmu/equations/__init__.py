"""All rows of a mechanism stacked: evaluated directly with numpy, or traced into a graph of arithmetic."""

from __future__ import annotations

from kinfmu.equations.graph import Graph, Node
from kinfmu.equations.system import Row, System

__all__ = ["Graph", "Node", "Row", "System"]
