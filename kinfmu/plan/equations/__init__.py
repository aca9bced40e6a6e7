"""All rows of a mechanism stacked: evaluated directly with numpy, or traced into a graph of arithmetic."""
