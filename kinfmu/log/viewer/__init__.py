"""Rerun: recordings of runs, their blueprint, comparison and pictures."""
