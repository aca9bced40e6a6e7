"""The Windows library of a native FMU, stepped under wine in parallel with that of Linux: `scripts/wine` runs it."""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import kinfmu
from kinfmu.codegen.c import compiler
from kinfmu.fmu import description
from kinfmu.fmu.native.platforms import PLATFORMS, Platform
from kinfmu.mechanism import gallery

HOST = Path(__file__).with_name("walk.c")
WINE = ("wine64", "wine", "/usr/lib/wine/wine64")  # Debian keeps it out of the path


def main() -> int:
    """Exit status 0 if both libraries say the same in both versions of FMI: to the bit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mechanism", nargs="?", default="fourbar", choices=gallery.names(), help="of the gallery")
    name = parser.parse_args().mechanism
    wine = next((found for one in WINE if (found := shutil.which(one))), None)
    if wine is None:
        print("wine is not there; Debian's package is wine64", file=sys.stderr)
        return 1
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:  # wine's services may still write there
        gaps = [_gap(name, fmi, Path(folder), wine) for fmi in (2, 3)]
    return 0 if max(gaps) == 0.0 else 1


def _gap(name: str, fmi: int, folder: Path, wine: str) -> float:
    """The largest difference of what the two libraries say."""
    linux, windows = (
        next(one for one in PLATFORMS if one.name == f"x86_64-{system}") for system in ("linux", "windows")
    )
    here = folder / f"fmi{fmi}"
    here.mkdir()
    fmu = kinfmu.build(kinfmu.load(name), here, flavour="native", drive="inputs", fmi=fmi, platforms="all")
    with zipfile.ZipFile(fmu) as zipped:
        zipped.extractall(here)
    ours, theirs = _walked(here, fmi, linux, []), _walked(here, fmi, windows, [wine])
    gap = float(np.abs(ours - theirs).max())
    print(
        f"{name}, FMI {fmi}.0: {ours.shape[1]} outputs at {len(ours)} poses, largest difference {gap:.2g}", flush=True
    )
    return gap


def _walked(folder: Path, fmi: int, platform: Platform, by: Sequence[str]) -> NDArray[np.float64]:
    """(361, outputs): all outputs of the platform's library over a turn; `by` runs the host."""
    about = description.read((folder / "modelDescription.xml").read_bytes(), "it")
    references = about.interface.value_references()
    outputs = [v.name for part in ("values", "rates", "accelerations") for v in about.interface.part(part)]
    suffix = ".exe" if platform.suffix == ".dll" else ""
    host = folder / f"walk{suffix}"
    compiler.compile_files(compiler.zig(platform.target), {HOST.name: HOST.read_text("utf-8")}, (f"-DFMI={fmi}",), host)
    library = folder / "binaries" / platform.folder(f"{fmi}.0") / f"{about.model_identifier}{platform.suffix}"
    command = [*by, str(host), str(library), about.token, str(references[outputs[0]]), str(len(outputs))]
    quiet = {**os.environ, "WINEDEBUG": "-all", "WINEPREFIX": str(folder.parent / "wine")}
    done = subprocess.run(command, capture_output=True, text=True, env=quiet, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{host.name} fails: {done.stdout}{done.stderr}")
    return np.array([line.split() for line in done.stdout.splitlines()], dtype=np.float64)


if __name__ == "__main__":
    sys.exit(main())
