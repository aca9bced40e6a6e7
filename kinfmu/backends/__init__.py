"""Back ends: each prints the one SolvePlan in a language."""
