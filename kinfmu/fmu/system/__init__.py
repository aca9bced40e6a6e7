"""Any FMU, and systems of several that an SSP connects: read, checked, stepped and recorded as one run."""
