"""Proofs over whole ranges of a driver, by interval arithmetic."""
