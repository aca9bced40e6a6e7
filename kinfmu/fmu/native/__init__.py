"""The native flavour: FMUs of generated C, which need no Python."""
