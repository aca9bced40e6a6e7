"""Code generation: the one SolvePlan printed as Python and as C."""
