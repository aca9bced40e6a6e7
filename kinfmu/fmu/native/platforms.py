"""Platforms that a native FMU can hold binaries for."""

from __future__ import annotations

import platform
import sys
from dataclasses import dataclass

from kinfmu.errors import FmuError


@dataclass(frozen=True)
class Platform:
    """A platform of a native FMU.

    Attributes:
        name: Name in FMI 3.0, and of its folder.
        fmi2: Name of the folder in FMI 2.0.
        target: Name of the target for zig.
        suffix: Suffix of libraries.

    """

    name: str
    fmi2: str
    target: str
    suffix: str

    def folder(self, version: str) -> str:
        """Return the folder of the binaries in an FMU of that version of FMI."""
        return self.fmi2 if version == "2.0" else self.name


PLATFORMS = (
    Platform("x86_64-linux", "linux64", "x86_64-linux-gnu.2.17", ".so"),
    Platform("aarch64-linux", "aarch64-linux", "aarch64-linux-gnu.2.17", ".so"),
    Platform("x86_64-windows", "win64", "x86_64-windows-gnu", ".dll"),
    Platform("x86_64-darwin", "darwin64", "x86_64-macos", ".dylib"),
    Platform("aarch64-darwin", "aarch64-darwin", "aarch64-macos", ".dylib"),
)
_MACHINES = {"amd64": "x86_64", "x86_64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}
_SYSTEMS = {"win32": "windows", "darwin": "darwin", "linux": "linux"}


def host() -> Platform:
    """Return the platform of this machine; raise an FmuError if native FMUs do not support it."""
    machine = platform.machine()
    name = f"{_MACHINES.get(machine.lower(), machine)}-{_SYSTEMS.get(sys.platform, sys.platform)}"
    for one in PLATFORMS:
        if one.name == name:
            return one
    raise FmuError(f"no native FMUs are built for {name}; platforms: {', '.join(one.name for one in PLATFORMS)}")
