"""Steps of native FMUs in real time: neither memory nor the system is asked for anything, and the work is bounded."""

from __future__ import annotations

import math
import platform
import random
import shutil
import subprocess
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

import kinfmu
from kinfmu.codegen.python import emit
from kinfmu.codegen.solve_bound import RUNS, solve_bound
from kinfmu.errors import RequestError
from kinfmu.mechanism import gallery
from kinfmu.plan import SolvePlan, compile_plan
from tests.fmu.conftest import Build, Start
from tests.fmu.host import DISCARD, OK, Host
from tests.fmu.native.test_memory import CC, program

STEPS = Path(__file__).with_name("steps.c")
STRACE, NM = shutil.which("strace"), shutil.which("nm")
HAS_GLIBC = platform.libc_ver()[0] == "glibc"
DEGREE = math.pi / 180.0


@pytest.fixture(
    scope="module",
    params=[("fourbar", 2, 1), ("five_bar", 3, 0), pytest.param(("slider_crank", 3, 1), marks=pytest.mark.long)],
    ids=str,
)
def stepping(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A program that steps an FMU through all kinds of poses, with or without discarded steps."""
    if CC is None or not HAS_GLIBC:
        pytest.skip("neither gcc nor clang is there, or the C library is not glibc")
    name, fmi, reaches_all = request.param
    folder = tmp_path_factory.mktemp(name)
    return program(kinfmu.load(name), fmi, folder, f"-DREACHES_ALL={reaches_all}", host=STEPS)


def test_a_step_asks_for_no_memory(stepping: Path) -> None:
    done = subprocess.run([stepping], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "begin\nend\n")


@pytest.mark.skipif(STRACE is None, reason="strace is not there")
def test_a_step_does_not_call_the_system(stepping: Path) -> None:
    log = stepping.with_name("calls")
    done = subprocess.run([str(STRACE), "-f", "-o", log, stepping], capture_output=True, text=True)
    if "ptrace" in done.stderr:
        pytest.skip("strace may not trace here")
    assert done.returncode == 0, done.stderr
    calls = [line.split(maxsplit=1)[1] for line in log.read_text().splitlines()]
    begin = next(k for k, call in enumerate(calls) if 'write(1, "begin' in call)
    assert 'write(1, "end' in calls[begin + 1]


@pytest.mark.skipif(NM is None, reason="nm is not there")
def test_an_fmu_uses_no_locks(stepping: Path) -> None:
    """A lock that is free is taken without a call of the system."""
    done = subprocess.run([str(NM), "--undefined-only", stepping], capture_output=True, text=True)
    names = [line.split()[-1] for line in done.stdout.splitlines()]
    assert any(name.startswith("write") for name in names)
    assert not [name for name in names if "pthread" in name or "mutex" in name or "lock" in name.replace("clock", "")]


def test_threads_step_instances_at_a_time(start: Start) -> None:
    def walked(host: Host, k: int) -> list[list[float]]:
        rows = []
        for n in range(2000):
            host.set({"crank_angle": (0.01 + 0.005 * k) * n})
            assert host.step(0.01 * n, 0.01) == OK
            rows.append(host.outputs())
        return rows

    alone = [walked(start(), k) for k in range(3)]
    hosts = [start() for _ in range(3)]
    with ThreadPoolExecutor(3) as pool:
        assert list(pool.map(walked, hosts, range(3))) == alone


# The work of a step


@pytest.fixture
def limited(start: Start) -> Callable[..., Host]:
    """`limited(n, name)`: an instance of a mechanism with at most n pose solves, 0: any number."""

    def get(most: int, name: str = "fourbar") -> Host:
        host = start(name, "inputs", initialize=False)
        host.set({"solver.most_work": most})
        host.initialize(0.0)
        return host

    return get


def _turned(host: Host, first: int, last: int) -> list[tuple[int, list[float]]]:
    """Status of doStep and outputs at each degree, up to the first step that is discarded."""
    found = []
    for k in range(first, last):
        host.set({"crank_angle": k * DEGREE})
        status = host.step(k * DEGREE, DEGREE)
        found.append((status, host.outputs() if status == OK else []))
        if status != OK:
            break
    return found


def test_the_work_of_a_pose_is_counted(limited: Callable[..., Host]) -> None:
    host = limited(0)
    bound = solve_bound(compile_plan(kinfmu.load("fourbar")))
    works = []
    for k in range(30, 400):
        host.set({"crank_angle": k * DEGREE})
        works.append(host.count("solver.work"))
        assert host.count("solver.iterations") <= works[-1] * bound.corrections
        assert host.step(k * DEGREE, DEGREE) == OK
        assert host.count("solver.work") == works[-1]
    away = [w for k, w in enumerate(works[1:], start=31) if min(k % 180, 180 - k % 180) > 12]
    assert set(away) == {1}
    assert 10 < max(works) < 100  # where a change point is found


def test_a_step_that_needs_more_work_than_it_may_take_is_discarded(limited: Callable[..., Host]) -> None:
    host, free = limited(5), limited(0)
    rows, wanted = _turned(host, 30, 200), _turned(free, 30, 200)
    assert rows[-1][0] == DISCARD
    assert rows[:-1] == wanted[: len(rows) - 1]  # to the bit
    assert 160 < 30 + len(rows) < 180  # the survey of the change point at 180 degrees
    assert host.status() == 3
    assert host.message().endswith("is not reached with 5 pose solves, the limit solver.most_work")
    assert 5 < host.count("solver.work") <= 5 + 8
    last = (30 + len(rows) - 2) * DEGREE
    host.set({"crank_angle": last - 0.1})
    assert host.step(last, DEGREE) == OK  # the pose before is still valid


def test_enough_work_changes_nothing(limited: Callable[..., Host]) -> None:
    assert _turned(limited(100), 30, 400) == _turned(limited(0), 30, 400)


@pytest.mark.parametrize("name", ["five_bar", "double_pendulum", "excavator"])
@pytest.mark.few(1)
def test_steps_of_several_drivers_within_the_limit_are_those_without_one(
    name: str, limited: Callable[..., Host]
) -> None:
    """Poses past a limit, next to singular points, and others."""
    host, free = limited(3, name), limited(0, name)
    rng = random.Random(7)  # noqa: S311  inputs by chance
    inputs = {one.name: float(one.start or 0.0) for one in host.about.interface.part("inputs")[::3]}
    seen = set()
    for k in range(300):
        wanted = {key: value + rng.choice([-0.2, 0.05, 0.2]) for key, value in inputs.items()}
        host.set(wanted)
        work = host.count("solver.work")
        seen.add(host.step(0.01 * k, 0.01))
        if host.status() >= 3:
            assert work <= 3 + 8 + 4 * (len(inputs) - 1)
            continue
        assert work <= 3
        inputs = wanted
        free.set(wanted)
        assert free.step(0.01 * k, 0.01) == OK
        assert free.count("solver.work") == work
        assert free.outputs() == host.outputs()
    assert seen == {OK, DISCARD}


def test_the_limit_does_not_hold_during_initialization(limited: Callable[..., Host]) -> None:
    host = limited(1)
    assert host.status() <= 2
    assert host.count("solver.work") > 1  # from the anchor to the start, next to a change point
    assert host.count("solver.most_work") == 1


def test_a_run_takes_the_limit(built_native: Build, fmi: int) -> None:
    fmu = built_native("slider_crank", fmi, "time")
    free, enough = kinfmu.simulate(fmu), kinfmu.simulate(fmu, parameters={"solver.most_work": "1"})
    assert enough.q.tolist() == free.q.tolist()
    with pytest.raises(RequestError, match=r"most_work = 2[.]5 must be a whole number of at least 0"):
        kinfmu.simulate(fmu, parameters={"solver.most_work": 2.5})


def test_an_invalid_limit_is_refused(start: Start) -> None:
    host = start("fourbar", "inputs", initialize=False)
    assert "solver.most_work = -1 must be at least 0; 0 stays" in host.refusal({"solver.most_work": -1})
    host.initialize(0.0)
    assert "solver.most_work = 7 comes too late" in host.refusal({"solver.most_work": 7})
    assert host.count("solver.most_work") == 0


class Counted(float):
    """A number that counts the operations on it."""

    operations = functions = 0


def _counting(name: str) -> Callable[..., Any]:
    operation = getattr(float, name)

    def counted(*numbers: Any) -> Any:
        Counted.operations += 1
        result = operation(*map(float, numbers))
        return Counted(result) if isinstance(result, float) else result

    return counted


for _name in ("add", "radd", "sub", "rsub", "mul", "rmul", "truediv", "rtruediv"):
    setattr(Counted, f"__{_name}__", _counting(f"__{_name}__"))
Counted.__neg__ = _counting("__neg__")  # type: ignore[method-assign]


def _function(function: Callable[..., float]) -> Callable[..., Counted]:
    def counted(*numbers: float) -> Counted:
        Counted.functions += 1
        return Counted(function(*map(float, numbers)))

    return counted


def _counted_model(plan: SolvePlan) -> dict[str, Any]:
    """The generated Python of a plan, whose formulas are those of C, on numbers that count."""
    model: dict[str, Any] = {"__name__": "kinfmu.solver.python.counted", "__package__": "kinfmu.solver.python"}
    exec(emit(plan), model)  # noqa: S102  our own generated source
    for name in ("sin", "cos", "atan2"):
        model[name] = _function(getattr(math, name))
    model["sqrt"] = lambda x: Counted(math.sqrt(x) if x == x else x)
    Counted.operations = Counted.functions = 0
    return model


def _numbers(values: Any) -> tuple[Counted, ...]:
    return tuple(map(Counted, values))


@pytest.mark.parametrize("name", [name for name in gallery.names() if not kinfmu.load(name).parameters])
@pytest.mark.few(6)
def test_a_pose_solve_takes_no_more_operations_than_its_bound(name: str) -> None:
    plan = compile_plan(kinfmu.load(name))
    bound, model = solve_bound(plan), _counted_model(plan)
    u, z = map(_numbers, plan.anchor_values)
    rest = _numbers([0.0] * len(z))
    off = _numbers([0.3 / (1 + k) for k in range(len(z))])  # so that Newton corrects
    try:
        found = model["position"](u, z, off, rest, Counted(0.3))
        values, speeds = found[-1], _numbers([1.0] * len(u))
        rates = model["velocity"](values, speeds)
        model["acceleration"](values, speeds, speeds, rates)
        model["watches"](values)
    except ArithmeticError:
        pass  # Newton took all its passes
    assert 0 < Counted.operations <= bound.operations
    assert Counted.functions <= bound.functions


@pytest.mark.parametrize("name", ["fourbar", "slider_crank", "crank_rocker"])
def test_all_corrections_take_a_good_part_of_the_bound(name: str) -> None:
    """Numbers that are none never settle, so that Newton takes all its passes of the only block that it solves."""
    plan = compile_plan(kinfmu.load(name))
    bound, model = solve_bound(plan), _counted_model(plan)
    u, z = _numbers(plan.anchor_values[0]), _numbers([math.nan] * len(plan.unknowns))
    with pytest.raises(ArithmeticError):
        model["position"](u, z, z, z, Counted(0.1))
    assert bound.operations / 5 < RUNS * Counted.operations <= bound.operations
    assert bound.functions / 5 < RUNS * Counted.functions <= bound.functions
