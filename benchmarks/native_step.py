"""What a step of the native FMU costs in a C host, without efforts and with them."""

from __future__ import annotations

import ctypes
import math
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, NamedTuple

from benchmarks.rounds import in_turn, spread, table
from kinfmu.codegen.c import compiler
from kinfmu.fmu import description
from kinfmu.fmu.build import build
from kinfmu.mechanism import Gravity, Mechanism, Point

STEPS = 360 * 200  # in a round, of one degree each: whole turns
ROUNDS = 40
INSTANCES = 200
DEGREE = ctypes.c_double(math.pi / 180.0)
_WORDS = {2: "Real", 3: "Float64"}


def run(mechanism: Mechanism, rounds: int = ROUNDS) -> str:
    """Return a table: processor time of a step (set 1, step, get 15) of the native FMU in both versions of FMI.

    Compared with a step that also reads the driver's effort, of the mechanism with masses; and what it takes to
    instantiate the FMU.
    """
    rows = []
    for fmi in (2, 3):
        with tempfile.TemporaryDirectory(prefix="kinfmu_bench_", ignore_cleanup_errors=True) as folder:
            plain, instantiate = instantiated(mechanism, fmi, Path(folder, "plain"))
            loaded, _ = instantiated(with_masses(mechanism), fmi, Path(folder, "loaded"), forces=1)
            seconds = in_turn([_rounds(plain), _rounds(loaded)], rounds, process_time)
        ns = [[value / STEPS * 1e9 for value in row] for row in seconds]
        ratio = spread([with_effort / without for without, with_effort in zip(*ns, strict=True)])
        rows.append(
            (
                f"FMI {fmi}.0, instantiate {instantiate * 1e6:.0f} us",
                *(f"{spread(times).median:.0f} ns" for times in ns),
                f"{ratio.median:.2f}",
                f"{ratio.lower:.2f} to {ratio.upper:.2f}",
            )
        )
    head = (
        "native FMU step: set 1, step 1 deg, get 15",
        "alone",
        "with masses, get also an effort",
        "ratio",
        "quartiles",
    )
    return "\n".join(table(head, rows))


def with_masses(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with gravity, and bodies of 1 kg whose centres of mass are away from their origins."""
    bodies = [
        body if body.is_ground else replace(body, mass=1.0, center_of_mass=Point(0.3, 0.1), inertia=0.1)
        for body in mechanism.bodies
    ]
    return replace(mechanism, bodies=tuple(bodies), gravity=Gravity(0.0, -9.81))


class Stepped(NamedTuple):
    """An initialized instance of an FMU, and the value references of the outputs that are read."""

    fmi: int
    library: Any
    instance: ctypes.c_void_p
    outputs: Sequence[int]

    def arguments(self) -> tuple[Any, ...]:
        """Return the first arguments of the functions in host.c: of set, step and get."""
        word, count = _WORDS[self.fmi], len(self.outputs)
        functions = [self.library[f"fmi{self.fmi}{name}"] for name in (f"Set{word}", "DoStep", f"Get{word}")]
        references, values = (ctypes.c_uint * count)(*self.outputs), (ctypes.c_double * count)()
        return (self.instance, *functions, 1, references, ctypes.c_size_t(count), values)


def host() -> Any:
    """Return the compiled functions of host.c."""
    return compiler.load({"host.c": Path(__file__).with_name("host.c").read_text("utf-8")})


def instantiated(mechanism: Mechanism, fmi: int, folder: Path, *, forces: int = 0) -> tuple[Stepped, float]:
    """Return the mechanism's FMU, and the seconds that an instance takes; forces: number of those read."""
    folder.mkdir()
    fmu = build(mechanism, folder / "ours.fmu", flavour="native", fmi=fmi, drive="inputs")
    with zipfile.ZipFile(fmu) as zipped:
        zipped.extractall(folder)
    about = description.read((folder / "modelDescription.xml").read_bytes(), "ours")
    binary = next(path for path in (folder / "binaries").rglob("*.*") if path.is_file())
    library = ctypes.CDLL(str(binary))
    token = about.token.encode()
    prefix = f"fmi{fmi}"
    if fmi == 2:
        create = library.fmi2Instantiate
        arguments: tuple[Any, ...] = (b"ours", 1, token, None, None, 0, 0)
    else:
        create = library.fmi3InstantiateCoSimulation
        false = ctypes.c_bool(False)
        arguments = (b"ours", token, None, *([false] * 4), None, ctypes.c_size_t(0), None, None, None)
    create.restype = ctypes.c_void_p
    start = perf_counter()
    instances = [ctypes.c_void_p(create(*arguments)) for _ in range(INSTANCES)]
    seconds = (perf_counter() - start) / INSTANCES
    for other in instances[1:]:
        library[f"{prefix}FreeInstance"](other)
    (instance, *_) = instances
    if fmi == 2:
        library.fmi2EnterInitializationMode(instance)
    else:
        zero = ctypes.c_double(0.0)
        library.fmi3EnterInitializationMode(instance, ctypes.c_bool(False), zero, zero, ctypes.c_bool(False), zero)
    library[f"{prefix}ExitInitializationMode"](instance)
    references = about.interface.value_references()
    motion = [about.interface.part(part)[:5] for part in ("values", "rates", "accelerations")]
    motion.append(about.interface.part("forces")[:forces])
    outputs = [references[variable.name] for variables in motion for variable in variables]
    return Stepped(fmi, library, instance, outputs), seconds


def _rounds(stepped: Stepped) -> Callable[[], None]:
    """Return a function that steps an FMU through a round in C, each of which continues the last one."""
    step, arguments = getattr(host(), f"host_run{stepped.fmi}"), stepped.arguments()
    rounds = count()

    def one() -> None:
        failed = step(*arguments, ctypes.c_long(next(rounds) * STEPS), ctypes.c_long(STEPS), DEGREE)
        if failed:
            raise RuntimeError(f"{failed} calls failed")

    return one
