"""scripts/bench: what is measured, where it is written, and the messages when something is missing or wrong."""

from __future__ import annotations

import csv
import re
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from benchmarks import accuracy, case, chains, crank_rockers, designs, jitter, log_files, native_sweep, singular
from benchmarks.__main__ import ALL, MEASUREMENTS, default_folder
from benchmarks.commands import COMMANDS
from benchmarks.engines import ENGINES, SHIPPED
from benchmarks.page import PAGE, SETTINGS
from benchmarks.singular_points import POINTS
from kinfmu.codegen.c import compiler
from kinfmu.errors import CompilerError
from kinfmu.mechanism import gallery
from tests import oracle
from tests.benchmarks.conftest import Command

QUICK = ["kinfmu", "kinfmu native", "generated Python", "numpy Newton", "scipy fsolve"]
PEERS = ("casadi", "pylinkage", "kimech")
PICTURES = [f"accuracy-{name}.{kind}" for name in ("singular", "work-precision") for kind in ("png", "svg")]


@pytest.fixture(scope="module")
def measured() -> tuple[accuracy.Result, tuple[tuple[singular.Near, ...], tuple[str, ...]]]:
    """What is measured on one mechanism in one round by the quick engines."""
    engines = [engine for engine in ENGINES if engine.name != "readable reference"]
    with pytest.MonkeyPatch.context() as patch:
        for package in PEERS:
            patch.setitem(sys.modules, package, None)
        return accuracy.measure(["slider_crank"], 1, engines=engines), singular.measure(1, engines=engines)


@pytest.fixture
def once(measured: tuple[object, object], monkeypatch: pytest.MonkeyPatch) -> None:
    """`scripts/bench accuracy` takes what was measured before."""
    monkeypatch.setattr(accuracy, "measure", lambda *_: measured[0])
    monkeypatch.setattr(singular, "measure", lambda *_: measured[1])


@pytest.fixture
def written(once: None, tmp_path_factory: pytest.TempPathFactory, pages: list[Path], command: Command) -> Path:  # noqa: ARG001
    """The folder of the tables and charts of what was measured, written once."""
    if not pages:
        pages.append(tmp_path_factory.mktemp("pages"))
        quick(command, "-o", pages[0])
    return pages[0]


@pytest.fixture(scope="module")
def pages() -> list[Path]:
    """The folder that `written` returns, once it is written."""
    return []


@pytest.fixture(autouse=True)
def only_what_comes_with_the_tests(monkeypatch: pytest.MonkeyPatch) -> None:
    """The packages of PEERS count as not installed, whether they are or not."""
    for package in PEERS:
        monkeypatch.setitem(sys.modules, package, None)


def quick(command: Command, *more: object) -> tuple[str, str]:
    """Output and messages of one round on one mechanism, written into the working folder by default."""
    result = command("accuracy", "--mechanism", "slider_crank", "--rounds", 1, *(more or ("-o", ".")))
    assert result.exit_code == 0
    return result.stdout, result.stderr


def rows_of(table: str) -> dict[str, list[str]]:
    """Cells of a Markdown table by the first one of their line."""
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines() if line[:1] == "|"]
    return {cells[0]: cells[1:] for cells in lines}


@pytest.mark.long
def test_tables_and_charts_are_written_in_the_requested_folder(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(case, "STEPS_BETWEEN", 1)
    monkeypatch.setattr(singular, "POINTS", POINTS[:1])
    stdout, stderr = quick(command, "-o", "there")
    files = sorted(path.name for path in (tmp_path / "there").iterdir())
    assert files == sorted([PAGE, SETTINGS, *PICTURES])
    *_, message = stdout.splitlines()
    assert message.startswith("written: ")
    assert set(re.findall(r"there/([\w.-]+)", message)) == set(files)
    assert stderr.splitlines() == [
        "left out: CasADi is not installed: pip install 'kinfmu[bench]'",
        "left out: kimech is not installed: pip install 'kinfmu[bench]'",
    ]
    page = (tmp_path / "there" / PAGE).read_text(encoding="utf-8")
    for part in ("engines", "singular points", "conditions"):
        (text,) = re.findall(f"<!-- generated: {part} -->\n\n(.*?)\n\n<!-- end: {part} -->", page, re.DOTALL)
        assert text in stdout
    assert "| readable reference |" in page


@pytest.mark.long
def test_the_tables_hold_every_engine_with_a_time_and_a_small_error_and_the_shipped_one_first(written: Path) -> None:
    page = (written / PAGE).read_text(encoding="utf-8")
    engines = rows_of(page.split("<!-- generated: engines -->")[1].split("<!-- end")[0])
    assert list(engines)[2:] == QUICK
    for engine in list(engines)[2:]:
        (cell,) = engines[engine]
        microseconds, error = map(float, re.fullmatch(r"([\d.]+) us, ([\de.-]+)", cell).groups())  # type: ignore[union-attr]
        assert microseconds > 1e-3
        assert error <= 1e-6
    head, *lines = csv.reader((written / SETTINGS).read_text(encoding="utf-8").splitlines())
    assert len(lines) == sum(len(engine.settings) for engine in ENGINES if engine.name in QUICK)
    assert {len(line) for line in (head, *lines)} == {12}
    for point in POINTS:
        assert f"| {point.title} |" in page
    first = next(line for line in lines if line[2] == "yes")
    assert first[1:6] == [SHIPPED.name, "yes", "velocity and acceleration", "full", "round-off"]


def test_it_writes_into_docs_of_a_checkout_and_else_into_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gallery, "folder", lambda: tmp_path / "fmus")
    assert default_folder() == Path()
    page = tmp_path / "docs" / PAGE
    page.parent.mkdir()
    page.touch()
    assert default_folder() == page.parent


@pytest.mark.usefixtures("once")
@pytest.mark.long
def test_a_page_of_the_user_keeps_the_text_between_its_tables(command: Command, tmp_path: Path) -> None:
    marks = "\n".join(
        f"word {name}\n<!-- generated: {name} -->old<!-- end: {name} -->"
        for name in ("singular points", "engines", "conditions")
    )
    (tmp_path / PAGE).write_text(marks, encoding="utf-8")
    quick(command)
    page = (tmp_path / PAGE).read_text(encoding="utf-8")
    assert "old" not in page
    assert re.findall(r"^word .*$", page, re.MULTILINE) == ["word singular points", "word engines", "word conditions"]


def test_a_page_without_a_place_for_a_table_is_refused(fails: Callable[..., str], tmp_path: Path) -> None:
    (tmp_path / PAGE).write_text("<!-- generated: conditions --><!-- end: conditions -->", encoding="utf-8")
    message = fails("accuracy", "-o", ".")
    assert message == "accuracy.md: must have <!-- generated: engines --> and <!-- end: engines -->, once each"


@pytest.mark.usefixtures("once")
@pytest.mark.long
def test_without_matplotlib_the_tables_are_written_and_the_reason_is_reported(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    _, stderr = quick(command)
    assert "drawing needs matplotlib: pip install 'kinfmu[figures]'" in stderr.splitlines()[-1]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([PAGE, SETTINGS])


@pytest.mark.long
def test_the_charts_name_every_engine_and_quantity(written: Path) -> None:
    chart = (written / "accuracy-work-precision.svg").read_text(encoding="utf-8")
    near = (written / "accuracy-singular.svg").read_text(encoding="utf-8")
    for engine in QUICK:
        assert f">{engine}<" in chart
        assert f">{engine}<" in near
    assert ">slider crank: 1 unknown<" in chart
    assert f">{POINTS[0].title}: q<" in near
    assert (written / "accuracy-singular.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("accurcy",),
            "Invalid value for '[WHAT]...': 'accurcy' is not a measurement; did you mean 'accuracy'?; "
            "known: accuracy, sample, sweep, designs, forces, step, native, jitter, log, commands, chains, size, all",
        ),
        (
            ("--mechanism", "slidercrank"),
            "Invalid value for '--mechanism': 'slidercrank' is not a mechanism of the gallery with a reference; "
            "did you mean 'slider_crank'?; known: cam_roller,",
        ),
        (("--rounds", "0"), "Invalid value for '--rounds': 0 is not in the range x>=1."),
        (("sample", "--mechanism", "fourbar"), "--mechanism is for accuracy, not for sample"),
        (("step", "commands", "-o", "there"), "-o is for accuracy, size, not for step, commands"),
    ],
)
def test_wrong_words_are_refused_with_what_would_be_right(
    arguments: tuple[str, ...], message: str, refuses: Callable[..., str], tmp_path: Path
) -> None:
    assert refuses(*arguments).startswith(message)
    assert not list(tmp_path.iterdir())


def test_the_help_has_a_line_for_every_measurement(command: Command) -> None:
    printed = command("--help").stdout
    assert re.findall(r"^  (\w+) {2,}[\w`]", printed, re.MULTILINE) == [*MEASUREMENTS, ALL]


@pytest.mark.parametrize(
    ("what", "lines"),
    [
        ("sample", ["readable reference", "python engine", "kinfmu.solve", "the same, error"]),
        pytest.param("step", ["fourbar", "toy (sin, cos)", "ratio, round by round"], marks=pytest.mark.long),
        pytest.param("native", ["FMI 2.0, ", "FMI 3.0, "], marks=pytest.mark.long),
        pytest.param("commands", ["pass", "import numpy", "import kinfmu", *COMMANDS], marks=pytest.mark.long),
    ],
)
@pytest.mark.few(1)
def test_a_measurement_prints_a_table_of_what_it_compares(what: str, lines: list[str], command: Command) -> None:
    result = command(what, "--rounds", 2)
    assert result.exit_code == 0
    head, *rows = result.stdout.splitlines()
    assert head
    assert len(rows) >= len(lines)
    for line, name in zip(rows[-len(lines) :], lines, strict=True):
        assert line.startswith(name)
        assert re.search(r"\d+\.\d", line)


def test_single_steps_at_a_rate_are_compared_with_an_empty_function() -> None:
    head, step, empty = jitter.run(kinfmu.load("fourbar"), rounds=2, steps=50).splitlines()
    assert head.startswith("100 steps at 10 kHz")
    assert step.startswith("fourbar: set 1, step 1 deg, get 15")
    for line in (step, empty):
        median, most, longest = map(float, re.findall(r"([\d.]+) us", line))
        assert 0.0 <= median <= most <= longest


def test_designs_are_compared_with_the_closed_form() -> None:
    mechanism, lengths = crank_rockers.crank_rocker(), crank_rockers.drawn(3)
    angles = np.linspace(0.0, 6.0, 7)
    found = kinfmu.compile(mechanism, ["coupler.phi", "rocker.phi"]).solve_designs(lengths, crank_angle=angles)
    for k in range(3):
        wanted = crank_rockers.closed_form(angles, *(values[k] for values in lengths.values()))
        off = np.exp(1j * found.values[k]) - np.exp(1j * np.stack(wanted, axis=1))
        assert np.abs(off).max() < 1e-14


@pytest.mark.long
def test_pylinkage_computes_the_pins_of_the_same_designs() -> None:
    pytest.importorskip("pylinkage")
    pytest.importorskip("numba")
    assert "pylinkage, by numba: points, not angles" in designs.run(rounds=1, designs=8)


@pytest.mark.long
def test_the_table_of_designs_has_a_row_for_every_way_to_solve_them() -> None:
    text = designs.run(rounds=1, designs=8)
    assert "8 crank-rockers at 361 angles" in text
    for row in (
        "Model.solve, Python engine",
        "solve_designs, q alone",
        "scipy.optimize.fsolve",
        "two threads",
        "8 designs at 361 angles with four measures",
        "Jansen's legs",
        "2 outputs at 361 angles, native",
    ):
        assert row in text


@pytest.mark.long
def test_a_sweep_is_compared_with_the_closed_form(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    try:
        compiler.command()
    except CompilerError as error:
        pytest.skip(str(error))
    monkeypatch.setenv("KINFMU_CACHE", str(tmp_path))
    monkeypatch.setattr("kinfmu.run.native_engine.FLAGS", ("-O1",))
    monkeypatch.setattr(native_sweep, "FLAGS", ("-O1",))
    table = native_sweep.run(rounds=1, samples=2000, loops=3)
    assert table.splitlines()[2].split()[-1] == "1.00"
    assert "crank-rocker, q, qd, qdd" in table
    assert "q alone takes 0." in table or "q alone takes 1." in table
    assert re.search(r"pylinkage, by numba: .* times that time|pylinkage with numba is not installed", table)
    assert "chain of 3 four-bars" in table


def test_the_closed_form_by_hand_is_right(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    try:
        compiler.command()
    except CompilerError as error:
        pytest.skip(str(error))
    monkeypatch.setenv("KINFMU_CACHE", str(tmp_path))
    u = np.linspace(0.1, 6.0, 50)
    columns = np.empty((15, 50))
    native_sweep.closed_form(u, columns)()
    exact = oracle.fourbar(40, 20, 50, 50, list(u))
    assert oracle.largest_error(columns[[0, 3, 4]].T, exact.q, modulo_turns=True) < 1e-13
    assert oracle.largest_error(columns[[5, 8, 9]].T, exact.qd) < 1e-13
    assert oracle.largest_error(columns[[10, 13, 14]].T, exact.qdd) < 1e-13


@pytest.mark.long
def test_chains_report_the_exponent(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chains, "LOOPS", (1, 2, 3, 4))
    stdout = command("chains", "--rounds", 2).stdout
    assert [line.split()[0] for line in stdout.splitlines()[2:6]] == ["1", "2", "3", "4"]
    assert re.search(r"exponent from 2 to 4 loops, round by round: -?\d+\.\d{3} \(", stdout)


@pytest.mark.long
def test_logs_are_compared_with_the_package_mcap(monkeypatch: pytest.MonkeyPatch) -> None:
    table = log_files.run(rounds=1, samples=5000, steps=500)
    for what in ("the record", "with what viewers draw"):
        assert re.search(rf"^the package mcap: {what} .* us/row +1\.0 +\d+\.\d B/row$", table, re.MULTILINE)
    sizes = [float(size) for size in re.findall(r"^MCAP.* ([\d.]+) B/row$", table, re.MULTILINE)]
    assert len(sizes) == 2
    assert sizes[0] < float(re.findall(r"may take (\d+) B", table)[0])
    monkeypatch.setattr(log_files, "find_spec", lambda _: None)
    monkeypatch.setattr(log_files, "FLAVOURS", ("python",))
    table = log_files.run(rounds=1, samples=100, steps=50)
    assert "\nmcap is not installed: pip install 'kinfmu[bench]'\n" in table
    assert "package mcap" not in table


@pytest.mark.long
def test_a_step_is_measured_alone_and_with_its_record_in_both_flavours(monkeypatch: pytest.MonkeyPatch) -> None:
    lines = log_files.logged_steps(rounds=1, steps=2000)
    assert re.fullmatch(r".* step alone +logged step", lines[0])
    costs = {}
    for line in lines[1:]:
        found = re.fullmatch(r"(python|native) +([\d.]+) us +best [\d.]+ +([\d.]+) us +best [\d.]+", line)
        assert found, line
        costs[found[1]] = float(found[2]), float(found[3])
    assert list(costs) == ["python", "native"]
    for alone, logged in costs.values():
        assert 0.0 < alone < logged
    assert costs["native"][1] < costs["python"][1]

    def no_compiler(*arguments: object, flavour: str, **more: object) -> Path:
        if flavour == "native":
            raise CompilerError("no C compiler found")
        return build(*arguments, flavour=flavour, **more)  # type: ignore[arg-type]

    build = log_files.build
    monkeypatch.setattr(log_files, "build", no_compiler)
    assert log_files.logged_steps(rounds=1, steps=50)[-1] == "native: no C compiler found"
