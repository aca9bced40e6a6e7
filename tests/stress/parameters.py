"""Random settings of FMUs whose plain numbers are parameters, against files with these numbers; see `--help`.

FMUs of the gallery are built with `parameters="all"`, in every flavour, and unpacked once in each process. Each setting
is compared with Python's `solve` of a file in whose generated code these numbers are numbers. An FMU may refuse a
setting if there is no such file, or if continuation does not reach its pose.
"""

from __future__ import annotations

import argparse
import gc
import os
import shutil
import sys
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

import kinfmu
from kinfmu import Mechanism, Run
from kinfmu.errors import FmuError, KinfmuError
from kinfmu.fmu.host import own
from kinfmu.fmu.unpacked import unpacked
from kinfmu.mechanism.gallery import names
from kinfmu.mechanism.opened import with_open_numbers
from kinfmu.processes import cores, processes, without_main
from kinfmu.run.continued import continued
from kinfmu.run.model import Model
from kinfmu.solver.python.pose import Status
from tests.stress.designs import CLOSE, SAMPLES, differences, drawn

PART = 5  # settings of a task
FLAVOURS: Mapping[str, Mapping[str, Any]] = {
    "python": {"flavour": "python"},
    "native": {"flavour": "native"},
    "native FMI 3": {"flavour": "native", "fmi": 3},
}


class Settings(NamedTuple):
    """Settings compared with their files.

    faults: What differs. counts: Settings that were stepped and refused, and samples by status, of the FMUs. worst:
    Largest differences of values, rates, accelerations and forces, of the largest of a column.
    """

    faults: list[str]
    counts: Counter[str]
    worst: tuple[float, ...]


def built(name: str, folder: Path, flavours: Sequence[str] = tuple(FLAVOURS)) -> dict[str, Path]:
    """Build FMUs of a mechanism of the gallery with all plain numbers as parameters; return them by flavour."""
    files = {flavour: folder / f"{name} {flavour}.fmu" for flavour in flavours}
    for flavour, path in files.items():
        kinfmu.build(kinfmu.load(name), path, parameters="all", page=False, **FLAVOURS[flavour])
    return files


def compared(name: str, fmus: Mapping[str, Path], count: int, seed: int, part: slice | None = None) -> Settings:
    """Compare FMUs with files of the numbers of each setting; part: of the settings."""
    mechanism = with_open_numbers(kinfmu.load(name), "all")
    span = mechanism.run.stop - mechanism.run.start
    t = mechanism.run.start + np.arange(SAMPLES) * (span / (SAMPLES - 1))
    found, counts, worst = [], Counter[str](), np.zeros(4)
    values = drawn(mechanism, count, seed)
    for k in range(count)[part or slice(None)]:
        setting = {key: float(array[k]) for key, array in values.items()}
        model, reason = _of_file(mechanism, setting)
        for flavour, fmu in fmus.items():
            where = f"{name}, seed {seed}, setting {k}, {flavour}"
            try:
                run = kinfmu.simulate(fmu, parameters=setting, start=t[0], stop=t[-1], step=span / (SAMPLES - 1))
            except FmuError as error:
                counts["refused"] += 1
                if not reason:
                    found.append(f"{where}: refused, but its file is solved: {error}")
                continue
            counts["stepped"] += 1
            counts.update(Status(status).name.lower() for status in run.status.tolist())
            if model is None:
                is_refused = run.status[-1] == Status.INCONSISTENT  # a redundant row, as soon as it does not close
                found += [] if is_refused else [f"{where}: stepped, but its file is not solved: {reason}"]
                continue
            file = model.solve(t[: len(run.t)])  # a run ends where a pose is not reached
            if len(run.t) < len(t) and run.good[-1]:
                found.append(f"{where}: ends at t = {run.t[-1]:.6g} in a good pose")
            apart, faults = differences(run.outputs, run.status, (run.values, run.rates, run.accelerations), file)
            worst = np.maximum(worst, [*apart, force := _of_forces(run, file)])
            faults += [f"forces differ by {force:.1e}"] if force > CLOSE[-1] and not faults else []
            found += [f"{where}: {fault}" for fault in faults]
    return Settings(found, counts, tuple(worst.tolist()))


def _of_file(mechanism: Mechanism, setting: Mapping[str, float]) -> tuple[Model | None, str]:
    """Return the model of the file with these numbers, None if it has none; and why an FMU may refuse them."""
    try:
        followed = continued(mechanism, setting)
        return kinfmu.compile(followed.mechanism, parameters=(), engine="python"), followed.message
    except KinfmuError as error:
        return None, str(error)


def _of_forces(run: Run, file: Run) -> float:
    """Return the largest difference of forces, of the largest of a column, in samples without a bridge."""
    is_plain = file.status == Status.OK
    worst = 0.0
    for name in run.force_names if is_plain.any() else ():
        got, wanted = run[name][is_plain], file[name][is_plain]
        worst = max(worst, float(np.max(np.abs(got - wanted)) / max(np.max(np.abs(wanted)), 1.0)))
    return worst


def main() -> int:
    """Compare random settings of the gallery; 1 if anything differs."""
    parser = argparse.ArgumentParser(prog="python -m tests.stress.parameters", description=__doc__)
    parser.add_argument("--count", type=int, default=500, help="settings of each mechanism; 500")
    parser.add_argument("--seed", type=int, default=0, help="of the settings; 0")
    parser.add_argument("names", nargs="*", help="mechanisms of the gallery; all")
    parser.add_argument("--flavours", nargs="+", choices=FLAVOURS, default=list(FLAVOURS), help="of the FMUs; all")
    parser.add_argument("--jobs", type=int, default=cores(), help="processes; as many as cores")
    given = parser.parse_args()
    wrong = 0
    with processes(given.jobs, gc.disable) as pool:
        for name in given.names or names():
            begun = time.monotonic()
            with TemporaryDirectory(prefix="kinfmu_stress_") as folder:
                fmus = built(name, Path(folder), given.flavours)
                with without_main():
                    parts = [slice(k, k + PART) for k in range(0, given.count, PART)]
                    waiting = [pool.submit(_part, name, fmus, given.count, given.seed, part) for part in parts]
                whole = [future.result() for future in waiting]
            found = [fault for one in whole for fault in one.faults]
            counts = sum((one.counts for one in whole), Counter[str]())
            worst = ", ".join(f"{value:.1e}" for value in np.max([one.worst for one in whole], axis=0))
            listed = ", ".join(f"{number} {what}" for what, number in counts.most_common())
            line = f"{name}: {given.count} settings, {len(found)} differences; {listed}; largest difference: {worst}"
            print(f"{line}; {time.monotonic() - begun:.0f} s", *found, sep="\n  ", flush=True)
            wrong += len(found)
    return 1 if wrong else 0


def _part(name: str, fmus: Mapping[str, Path], count: int, seed: int, part: slice) -> Settings:
    """Compare a part of the settings; garbage is collected once, after it."""
    setattr(own, "unpacked", lambda path: nullcontext(_folder(path)))  # noqa: B010  # for mypy
    try:
        return compared(name, fmus, count, seed, part)
    finally:
        gc.collect()


@cache
def _folder(fmu: Path) -> Path:
    """Unpack an FMU once in this process, next to its file, whose folder is removed at the end."""
    with unpacked(fmu) as folder:
        return Path(shutil.copytree(folder, fmu.with_suffix(f".{os.getpid()}")))


if __name__ == "__main__":
    from tests.stress.parameters import main as main_of_module  # whose functions the workers find

    sys.exit(main_of_module())
