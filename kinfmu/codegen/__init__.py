"""Code generation: one SolvePlan printed as Python and as C."""
