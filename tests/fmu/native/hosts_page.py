"""The table of docs/hosts.md of what was run: python -m tests.fmu.native.hosts_page runs the tests and writes it."""

from __future__ import annotations

import platform
import re
import subprocess
import sys
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

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
    text = table(datetime.now(UTC).date().isoformat(), counts)
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(_BLOCK.sub(lambda found: f"{found[1]}\n{text}\n\n{found[2]}", page), encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
