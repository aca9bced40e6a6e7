"""C compiled for tests: without optimization, which gives the same numbers, in few units, each compiled once.

Most of a library is the run time, and most of the run time depends on the sizes of the mechanism alone: designs with
other lengths, and libraries for sweeps and for FMUs, link the same objects. The run time must be clean under the
strictest warnings. Objects and libraries are kept for later runs as long as the texts, the compiler and this file stay.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from kinfmu.codegen.c import compiler
from kinfmu.fmu.native import sources

FILE_BY_FILE = compiler.compile_files
STRICT = ("-Wall", "-Wextra", "-Wconversion", "-Werror")
UNUSED = {"-shared", "-fno-math-errno", "-fno-trapping-math", "-falign-functions=64", "-falign-loops=32", "-s", *STRICT}
SINES = "-DKF_LIBRARY_SINCOS"

PER_SAMPLE = {"curve.c", "position.c", "pose.c", "solver.c", "trusted_step.c"}  # some FMUs include them elsewhere
SWEEPS = {path.name for path in compiler.RUNTIME.glob("*.c")} - set(compiler.SOLVER) | {"segments.c", "side_by_side.c"}
SOLVER = {name for name in compiler.SOLVER if name.endswith(".c")} - PER_SAMPLE
INSTANCE = {path.name for path in sources.RUNTIME.glob("*.c")}
KEPT = 7 * 86400.0  # [s] that objects are kept without being used
GROUPS = {"search.c": SOLVER, "per_sample.c": PER_SAMPLE, "sweeps.c": SWEEPS, "instance_units.c": INSTANCE}


def folder(cache: Path) -> Path:
    """Return the folder for what is compiled, by the content of this file; remove what is old."""
    here = cache / hashlib.sha256(Path(__file__).read_bytes()).hexdigest()[:12]
    for other in cache.iterdir():
        if other != here and other.stat().st_mtime < time.time() - KEPT:
            shutil.rmtree(other, ignore_errors=True)
    for path in (here / "objects").glob("*.o"):
        if path.stat().st_mtime < time.time() - KEPT:
            path.unlink(missing_ok=True)  # another worker may have been first
    return here


def compile_files(
    cc: Sequence[str], files: Mapping[str, str], flags: Sequence[str], output: Path, rare: Sequence[str] = ()
) -> None:
    """Compile a library as `kinfmu.codegen.c.compiler` does, from fewer units; take objects that are there already."""
    if "-O0" not in flags:
        FILE_BY_FILE(cc, files, flags, output, rare)
        return
    files = {name: text for name, text in files.items() if name not in rare}  # they join files
    names = compiler.units(files)
    joined = {unit: [f'#include "{name}"\n' for name in names if name in group] for unit, group in GROUPS.items()}
    files = {**files, **{unit: "".join(lines) for unit, lines in joined.items() if lines}}
    if "ziglang" in cc:
        FILE_BY_FILE(cc, files, flags, output)
        return
    kept = Path(os.environ["KINFMU_CACHE"]) / "objects"
    kept.mkdir(parents=True, exist_ok=True)
    objects, commands = [], []
    with tempfile.TemporaryDirectory(dir=kept) as scratch:
        for name, text in files.items():
            (Path(scratch) / name).write_text(text, "utf-8", newline="\n")
        for unit in compiler.units(files):
            text = _content(files, unit, set())
            used = {flag for flag in flags if flag not in UNUSED and (flag != SINES or SINES[2:] in text)}
            used |= {"-fvisibility=hidden"} if unit == "search.c" else set()  # as in FMUs
            used |= (
                set(STRICT) if unit in GROUPS or "-Werror" in flags else set()
            )  # generated files may have more names
            command = [*cc, *sorted(used), "-c", unit]
            key = hashlib.sha256("\0".join([*compiler._version(tuple(cc)), *command, text]).encode()).hexdigest()[:24]
            objects.append(kept / f"{key}.o")
            if objects[-1].exists():
                objects[-1].touch()
            else:
                commands.append([*command, "-o", objects[-1].name])
        compiler._run(commands, scratch)
        for command in commands:
            (Path(scratch) / command[-1]).replace(kept / command[-1])
        compiler._run([[*cc, *flags, *map(str, objects), "-o", str(output.resolve()), "-lm"]], scratch)


def _content(files: Mapping[str, str], name: str, seen: set[str]) -> str:
    """Return the text of a C file and of all that it includes, without comments."""
    if name in seen or name not in files or name == "kf_names.h":  # which defines nothing without a prefix
        return ""
    seen.add(name)
    code = re.sub(r"/\*.*?\*/", "", files[name], flags=re.DOTALL)
    included = re.findall(r'^ *# *include "([\w.]+)"', code, re.MULTILINE)
    return "".join([code.replace('#include "kf_names.h"\n', ""), *(_content(files, one, seen) for one in included)])
