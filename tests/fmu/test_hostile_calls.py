"""Python FMUs: calls that no host should make get one message and Discard; none is Fatal, and nothing changes."""

from __future__ import annotations

import json
import math
import random
import sys
from collections.abc import Callable
from typing import Any

import pytest

from tests.fmu.host import Host

Start = Callable[..., Host]

NO_STEPS = [
    (math.nan, 0.1), (math.inf, 0.1), (-math.inf, 0.1), (0.2, math.nan), (0.2, math.inf), (0.2, -0.1), (0.2, -5e-324),
    (1.7e308, 1.7e308), (-0.3, 0.1), (-1e300, 0.1),
]  # fmt: skip


@pytest.mark.parametrize("drive", ["inputs", "time"])
@pytest.mark.parametrize(("t", "h"), NO_STEPS)
def test_a_step_that_is_none_is_discard_and_changes_nothing(start: Start, drive: str, t: float, h: float) -> None:
    host, other = start("fourbar", drive), start("fourbar", drive)
    assert not host.step(t, h)
    for one in (host, other):
        one.set({"crank_angle": 0.3} if drive == "inputs" else {})
        assert one.step(0.0, 0.1)
        assert one.step(0.1, 0.0)
    assert any("doStep from t = " in text for _, text in host.messages)
    assert not host.step(t, h)
    assert host.outputs() == other.outputs()
    assert all(math.isfinite(value) for value in host.get("rocker.phi", "rocker.omega", "rocker.alpha"))
    assert host.step(0.1, 0.1)


@pytest.mark.parametrize("drive", ["inputs", "time"])
def test_steps_before_initialization_and_after_terminate_are_discard(start: Start, drive: str) -> None:
    host = start("fourbar", drive, initialize=False)
    assert not host.step(0.0, 0.1)
    host.initialize(0.0)
    assert host.step(0.0, 0.1)
    host.slave.terminate()
    assert not host.step(0.1, 0.1)
    assert "doStep before the end of initialization, or after terminate" in host.messages[-1][1]
    host.slave.reset()
    assert not host.step(0.1, 0.1)
    host.initialize(0.0)
    assert host.step(0.0, 0.1)


@pytest.mark.parametrize("t", [math.nan, math.inf])
def test_a_start_time_that_is_no_number_is_refused(start: Start, t: float) -> None:
    host = start("fourbar", "time", initialize=False)
    host.initialize(t)
    assert not host.step(0.0, 0.1)
    assert any("start time = " in text for _, text in host.messages)
    assert host.step(0.0, 0.1)
    assert math.isfinite(host.get("rocker.omega")[0])


def test_runs_may_start_before_time_0(start: Start) -> None:
    host = start("fourbar", "time", initialize=False)
    host.initialize(-2.0)
    assert host.step(-2.0, 0.5)
    assert host.step(-1.5, 0.5)


HUGE = [1e101, -1e155, 1e300, -1.7e308]


@pytest.mark.parametrize("name", ["crank_angle", "crank_speed", "crank_acceleration", "crank.speed"])
def test_numbers_whose_squares_are_infinite_are_refused(start: Start, name: str) -> None:
    host = start("fourbar", "time" if name == "crank.speed" else "inputs")
    (before,) = host.get(name)
    for value in HUGE:
        host.set({name: value})
        assert host.get(name) == [before]
        assert f"{name} = {value!r} is too large: at most 1e+100 is taken; {before!r} stays" in host.messages[-1][1]
        assert not host.step(0.0, 0.1)
    assert host.step(0.0, 0.1)


@pytest.mark.parametrize("h", [5e-324, 1e-300, 1e-150])
def test_rates_estimated_over_no_time_are_no_infinities(start: Start, h: float) -> None:
    host = start()
    for k in range(6):
        host.set({"crank_angle": 0.1 * k})
        assert all(math.isfinite(value) for value in host.outputs()), k
        assert host.step(k * h, h)
        assert all(math.isfinite(value) for value in host.outputs()), k


def test_laws_whose_rates_are_beyond_all_bounds_have_no_pose(start: Start) -> None:
    host = start("crank_rocker", "time")
    host.set({"crank.speed": 1e100})
    assert all(math.isfinite(value) for value in host.outputs())
    assert not host.step(0.0, 0.1)
    host.set({"crank.speed": 1.0})
    assert host.step(0.0, 0.1)


def damaged(data: bytes, rng: random.Random) -> bytes:
    """A state with some of its bytes changed, missing or added."""
    kind = rng.randrange(4)
    place = rng.randrange(len(data))
    if kind == 0:
        return data[:place]
    if kind == 1:
        return data + bytes([rng.randrange(256)])
    changed = bytearray(data)
    for _ in range(1 if kind == 2 else 9):
        place = rng.randrange(len(data))
        changed[place] ^= 1 << rng.randrange(8)
    return bytes(changed)


def test_damaged_states_are_refused_and_the_slave_goes_on(start: Start) -> None:
    rng = random.Random(6)  # noqa: S311  damage by chance
    host = start()
    for k in range(5):
        host.set({"crank_angle": 0.1 * k, "crank_speed": 1.0})
        assert host.step(0.1 * k, 0.1)
    before = host.outputs()
    data = host.slave.serializeFMUstate(host.slave.getFMUstate())
    for k in range(60):
        state = host.slave.deSerializeFMUstate(damaged(data, rng))
        host.slave.setFMUstate(state)
        host.slave.freeFMUstate(state)
        assert host.outputs() == before, k
        assert "state is damaged, or not one of this FMU" in host.messages[-1][1]
    assert not host.step(0.5, 0.1)
    assert host.step(0.5, 0.1)
    whole = host.slave.deSerializeFMUstate(data)
    host.slave.setFMUstate(whole)
    assert host.outputs() == before


def _call(host: Host, rng: random.Random, states: list[Any]) -> None:
    """One call of any kind, as a host should or should not make it."""
    odd = [math.nan, math.inf, -math.inf, 5e-324, -0.0, 1e308, -1e308, 1e99, 1e16, 1e-300]

    def number() -> float:
        return rng.choice(odd) if rng.random() < 0.2 else rng.uniform(-4.0, 4.0)

    count = len(host.references)
    references = [rng.choice([0, count + 1, 2**31 - 1, 1 + rng.randrange(count)]) for _ in range(rng.randrange(5))]
    slave = host.slave
    kind = rng.randrange(12)
    if kind < 3:
        slave.setReal([1, 2, 3], [number(), number(), number()])
    elif kind < 6:
        host.step(number() if rng.random() < 0.2 else 0.1, number() if rng.random() < 0.2 else 0.1)
    elif kind == 6:
        slave.setReal(references, [number() for _ in references])
        slave.getReal(references)
    elif kind == 7:
        slave.setInteger(references, [rng.choice([0, 1, 2, -7, 2**31 - 1]) for _ in references])
        slave.setBoolean(references, [rng.random() < 0.5 for _ in references])
        slave.getInteger(references)
        slave.getBoolean(references)
        slave.getString(references)
    elif kind == 8:
        states.append(slave.getFMUstate())
    elif kind == 9 and states:
        slave.setFMUstate(rng.choice(states))
    elif kind == 10 and states:
        data = slave.serializeFMUstate(rng.choice(states))
        slave.setFMUstate(slave.deSerializeFMUstate(damaged(data, rng) if rng.random() < 0.5 else data))
    elif kind == 11 and rng.random() < 0.3:
        rng.choice([slave.terminate, slave.reset, lambda: host.initialize(0.0), lambda: host.initialize(number())])()


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(("name", "drive"), [("fourbar", "inputs"), ("crank_rocker", "time"), ("five_bar", "inputs")])
def test_no_call_by_chance_is_fatal_and_no_output_infinite(start: Start, name: str, drive: str, seed: int) -> None:
    rng = random.Random(seed)  # noqa: S311  calls by chance
    host = start(name, drive)
    states: list[Any] = []
    for k in range(400):
        _call(host, rng, states)
        assert all(math.isfinite(value) for value in host.outputs()), k
    assert not [text for _, text in host.messages if "defect" in text]


FORGED = [{"token": None}, {"inputs": [[]]}, {"inputs": []}, {"history": 7}, {"committed": "x"}, {"tolerance": "x"}]


@pytest.mark.parametrize("content", [[], {}, None, 7, *FORGED])
def test_states_that_no_slave_has_written_are_refused(start: Start, content: Any) -> None:
    host = start()
    slave_class = _slave_class(host)
    before = host.outputs()
    if content in FORGED:
        content = json.loads(host.slave.serializeFMUstate(host.slave.getFMUstate())[32:]) | content
    host.slave.setFMUstate(host.slave.deSerializeFMUstate(slave_class._fmu_state_to_bytes(content)))
    assert host.outputs() == before
    assert "state is damaged" in host.messages[-1][1]
    assert not host.step(0.0, 0.1)
    assert host.step(0.0, 0.1)


def _slave_class(host: Host) -> Any:
    """The slave's class; its module's name carries a hash."""
    modules = [module for name, module in list(sys.modules.items()) if name.endswith("_slave")]
    classes = [module.Slave for module in modules if hasattr(module, "Slave")]
    return next(one for one in classes if one.layout.token == host.about.token)


def test_messages_are_no_formats(start: Start) -> None:
    slave = _slave_class(start())(instance_name="x", resources=".")
    slave.log("100% of %n %s, #r1#")
    assert [message.msg for message in slave._get_log_queue()] == ["100%% of %%n %%s, ##r1##"]


def test_a_host_of_kinfmu_shows_messages_as_they_were_meant(start: Start) -> None:
    from kinfmu.fmu.slaves import fmi2_callbacks

    heard: list[tuple[int, str]] = []
    host = start()
    fmi2_callbacks(lambda *message: heard.append(message)).logger(None, b"x", 1, b"", b"100%% of ##r1##")
    host.set({"crank_angle": math.nan})
    assert heard == [(1, "100% of #r1#")]
