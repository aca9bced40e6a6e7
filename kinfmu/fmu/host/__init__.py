"""The host of FMUs: any FMU, and systems of several, read, checked, stepped and recorded as one run."""
