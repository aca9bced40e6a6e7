"""The tables of docs/hosts.md of what was run: python -m tests.fmu.native.hosts_page runs it and writes them."""

from __future__ import annotations

import json
import platform
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from shutil import copy
from typing import NamedTuple

import numpy as np

import kinfmu
from kinfmu.arrays import FloatArray
from kinfmu.fmu.unpacked import unpacked

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "hosts.md"
_BLOCK = re.compile(r"(<!-- hosts -->\n).*?(<!-- end: hosts -->)", re.DOTALL)


class Host(NamedTuple):
    """A co-simulation tool, the package that brings it, and the tests that run in it."""

    name: str
    page: str
    package: str
    what: str
    tests: tuple[str, ...]
    chosen: str  # by pytest's -k


PAGES = ("tests/docs/test_host_pages.py", "tests/docs/test_pages.py")
HOSTS = (
    Host(
        "fmpy",
        "host-fmpy.md",
        "FMPy",
        "both flavours, FMI 2.0 and 3.0, co-simulation and model exchange; limits; SI units; the page",
        ("tests/fmu/native/test_numbers.py", "tests/fmu/test_si.py", "tests/docs/test_host_pages.py"),
        "(fmpy or si_units or si.py) and not moves_as",
    ),
    Host(
        "libcosim",
        "host-osp.md",
        "libcosimpy",
        "both flavours, FMI 2.0; limits; SSP, of two FMUs too; OSP system structure with groups of variables; the page",
        ("tests/fmu/native/test_hosts.py", "tests/fmu/test_ssp.py", *PAGES),
        "libcosim or (osp and not ecospy)",
    ),
    Host(
        "Ecos",
        "host-ecos.md",
        "ecospy",
        "from Python both flavours, FMI 2.0 and 3.0; the `ecos` command; limits; SSP, of two FMUs too; the page",
        ("tests/fmu/native/test_hosts.py", "tests/fmu/test_ssp.py", *PAGES),
        "ecos",
    ),
)


MECHANISM, STEP, COUNT = "crank_rocker", 0.02, 100
ANGLES = [0.3 * k * STEP for k in range(1, COUNT + 1)]  # [rad] that inputs set, from the pose of the start
AT_REST = [0.0] * COUNT  # the start of the input, which laws ignore
SHOWN = ("crank.phi", "coupler.x")
FLAVOURS = {"python, FMI 2.0": ("python", 2), "native, FMI 2.0": ("native", 2), "native, FMI 3.0": ("native", 3)}
Stepped = Callable[[Path], FloatArray]  # from an FMU to rows of the crank's angle and the coupler's place


def rows_of_kinfmu(path: Path) -> FloatArray:
    run = kinfmu.simulate(path, stop=STEP * COUNT, step=STEP)
    return np.column_stack([run[name] for name in SHOWN])


def rows_of_kinfmu_by_inputs(path: Path) -> FloatArray:
    t = STEP * np.arange(COUNT)
    run = kinfmu.simulate(path, inputs={"time": t, "crank_angle": ANGLES}, step=STEP)
    return np.column_stack([run[name] for name in SHOWN])


def rows_of_fmpy(path: Path, kind: str = "CoSimulation", **options: object) -> FloatArray:
    from fmpy import simulate_fmu

    rows = simulate_fmu(
        str(path), fmi_type=kind, start_time=0.0, stop_time=STEP * COUNT, output_interval=STEP, output=SHOWN, **options
    )
    return np.column_stack([rows[name] for name in SHOWN])


def rows_of_fmpy_by_inputs(path: Path) -> FloatArray:
    t = STEP * np.arange(COUNT)
    table = np.rec.fromarrays([t, np.array(ANGLES)], names=["time", "crank_angle"])
    return rows_of_fmpy(path, input=table)


def rows_of_process(host: str, path: Path, angles: list[float]) -> FloatArray:
    """Let libcosimpy or ecospy step an FMU, in a process of its own."""
    from tests.fmu.native.test_hosts import _driven  # here: it looks for the hosts when it is imported

    rows = _driven(host, path, path.parent, STEP, angles, *SHOWN)
    assert rows[:, :2].all()  # each step is done and ok
    return rows[:, 2:]


def rows_of_ecos(path: Path) -> FloatArray:
    from tests.fmu.native.test_hosts import table_of_ecos

    folder = Path(tempfile.mkdtemp(dir=path.parent))
    header, lines = table_of_ecos(path, STEP * COUNT, STEP, folder)
    columns = [next(k for k, cell in enumerate(header) if f"::{name}[" in cell.replace(" ", "")) for name in SHOWN]
    return np.array([[float(line[k]) for k in columns] for line in lines])


def rows_of_container(path: Path) -> FloatArray:
    """Let fmpy step the FMU into which FMUContainer puts an FMU."""
    folder = Path(tempfile.mkdtemp(dir=path.parent))
    outputs = [[path.name, name, name] for name in SHOWN]
    explicit = {f"auto_{kind}": False for kind in ("input", "link", "output")}
    held = explicit | {"name": "held.fmu", "step_size": STEP, "fmu": [path.name], "output": outputs}
    (folder / "held.json").write_text(json.dumps(held))
    copy(path, folder)
    program = "from fmu_manipulation_toolbox.cli.fmucontainer import fmucontainer; fmucontainer()"
    subprocess.run(
        [sys.executable, "-c", program, "-container", "held.json"], cwd=folder, check=True, capture_output=True
    )
    return rows_of_fmpy(folder / "held.fmu", step_size=STEP)


def rows_of_casadi(path: Path) -> FloatArray:
    """Let CasADi evaluate an FMU for model exchange; it reads Float64 outputs only."""
    import casadi

    with unpacked(path) as folder:
        builder = casadi.DaeBuilder("it", str(folder))
        builder.set_y([name for name in SHOWN if name in builder.y()])
        outputs = builder.create("outputs", ["t", "u", "p"], ["y"])
        u, p = builder.get(builder.u()), builder.get(builder.p())
        return np.array([outputs(STEP * k, u, p).full().ravel() for k in range(COUNT + 1)])


CLIENTS: tuple[tuple[str, str, str, Stepped], ...] = (  # client, mode, flavours that it takes, what steps
    ("kinfmu simulate", "laws", "all", rows_of_kinfmu),
    ("kinfmu simulate", "inputs", "all", rows_of_kinfmu_by_inputs),
    ("fmpy", "laws", "all", rows_of_fmpy),
    ("fmpy", "inputs", "all", rows_of_fmpy_by_inputs),
    ("fmpy", "model exchange, laws", "native", lambda path: rows_of_fmpy(path, "ModelExchange")),
    ("libcosim", "laws", "FMI 2.0", lambda path: rows_of_process("libcosimpy", path, AT_REST)),
    ("libcosim", "inputs", "FMI 2.0", lambda path: rows_of_process("libcosimpy", path, ANGLES)),
    ("Ecos, from Python", "laws", "all", lambda path: rows_of_process("ecospy", path, AT_REST)),
    ("Ecos, from Python", "inputs", "all", lambda path: rows_of_process("ecospy", path, ANGLES)),
    ("the `ecos` command", "laws", "native", rows_of_ecos),
    ("FMUContainer", "laws", "all", rows_of_container),
    ("CasADi", "model exchange, laws", "native", rows_of_casadi),
)


ABOUT_MATRIX = (
    f"Largest error of the coupler of `{MECHANISM}` in {COUNT} steps of {STEP} s, against the Python engine at the\n"
    "same angle of the crank, relative to the largest coordinate. `-`: the tool does not take such an FMU. The\n"
    "`ecos` command writes six decimals."
)


def matrix() -> str:
    """Return the table of clients, modes and flavours: the largest error of a place, relative to the largest place."""
    mechanism = kinfmu.load(MECHANISM)
    lines = [f"| tool | driven by | {' | '.join(FLAVOURS)} |", "|---|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as folder:
        for client, mode, taken, stepped in CLIENTS:
            cells = []
            for title, (flavour, fmi) in FLAVOURS.items():
                if taken != "all" and taken not in title:
                    cells.append("-")
                    continue
                drive = "inputs" if mode == "inputs" else "time"
                path = Path(folder, f"{drive}_{flavour}_{fmi}", f"{MECHANISM}.fmu")
                if not path.exists():
                    kinfmu.build(mechanism, path, flavour=flavour, fmi=fmi, drive=drive, page=False)
                angles, places = stepped(path).T
                assert len(np.unique(angles)) > COUNT - 3, (client, mode, title)  # it moved, up to the end
                exact = kinfmu.solve(mechanism, crank_angle=angles)[SHOWN[1]]
                error = np.abs(places - exact).max() / np.abs(exact).max()
                cells.append(f"{error:.0e}" if error else "0")
            lines.append(f"| {client} | {mode} | {' | '.join(cells)} |")
    return "\n".join(lines)


def run(host: Host) -> int:
    """Run the tests of a host and return their number; end the program if one fails or is skipped."""
    command = [sys.executable, "-m", "pytest", "-n", "0", "-q", "-rs", "--long", *host.tests, "-k", host.chosen]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    counts = {word: int(count) for count, word in re.findall(r"(\d+) (passed|failed|skipped|error)", done.stdout)}
    if done.returncode or set(counts) != {"passed"}:
        sys.exit(f"{host.name}: tests fail or are skipped\n{done.stdout[-3000:]}")
    return counts["passed"]


def table(today: str, counts: dict[str, int]) -> str:
    """Return the table; counts: number of tests by name of the host."""
    system = f"{platform.system()} {platform.machine()}, Python {platform.python_version()}"
    lines = ["| tool | version | run on | tests | what |", "|---|---|---|---|---|"]
    for host in HOSTS:
        stated = f"{host.package} {version(host.package)}"
        lines.append(f"| [{host.name}]({host.page}) | {stated} | {today} | {counts[host.name]} passed | {host.what} |")
    return "\n".join([*lines, "", f"System: {system}."])


def main() -> None:
    """Run all tests and write the table."""
    counts = {host.name: run(host) for host in HOSTS}
    text = f"{table(datetime.now(UTC).date().isoformat(), counts)}\n\n{ABOUT_MATRIX}\n\n{matrix()}"
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(_BLOCK.sub(lambda found: f"{found[1]}\n{text}\n\n{found[2]}", page), encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
