"""Benchmarks: what kinfmu costs, side by side with a baseline, in one run."""
