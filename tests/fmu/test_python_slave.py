"""Python FMUs: what only they have; invalid calls get a message and Discard, are never Fatal and change nothing."""

from __future__ import annotations

import json
import math
import random
import sys
from collections.abc import Callable
from typing import Any

import pytest

from kinfmu.solver.python import Solver
from tests.fmu.host import DISCARD, OK, Host

Start = Callable[..., Host]


@pytest.mark.parametrize("t", [math.nan, math.inf])
def test_a_start_time_that_is_not_finite_is_refused(start: Start, t: float) -> None:
    host = start("fourbar", "time", initialize=False)
    host.initialize(t)
    assert host.step(0.0, 0.1) == DISCARD
    assert any("start time = " in text for _, text in host.messages)
    assert host.step(0.0, 0.1) == OK
    assert math.isfinite(host.get("rocker.omega")[0])


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


def test_damaged_states_are_refused_and_the_slave_continues(start: Start) -> None:
    rng = random.Random(6)  # noqa: S311  damage by chance
    host = start()
    for k in range(5):
        host.set({"crank_angle": 0.1 * k, "crank_speed": 1.0})
        assert host.step(0.1 * k, 0.1) == OK
    before = host.outputs()
    data = host.serialize(host.state())
    for k in range(60):
        state = host.deserialize(damaged(data, rng))
        host.restore(state)
        host.free_state(state)
        assert host.outputs() == before, k
        assert "state is damaged, or not one of this FMU" in host.messages[-1][1]
    assert host.step(0.5, 0.1) == DISCARD
    assert host.step(0.5, 0.1) == OK
    whole = host.deserialize(data)
    host.restore(whole)
    assert host.outputs() == before


def _call(host: Host, rng: random.Random, states: list[Any]) -> None:
    """One call of any kind, as a host should or should not make it."""
    odd = [math.nan, math.inf, -math.inf, 5e-324, -0.0, 1e308, -1e308, 1e99, 1e16, 1e-300]

    def number() -> float:
        return rng.choice(odd) if rng.random() < 0.2 else rng.uniform(-4.0, 4.0)

    count = len(host.references)
    references = [rng.choice([0, count + 1, 2**31 - 1, 1 + rng.randrange(count)]) for _ in range(rng.randrange(5))]
    slave = host.fmu
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
@pytest.mark.few(2)
def test_random_calls_are_never_fatal_and_outputs_stay_finite(start: Start, name: str, drive: str, seed: int) -> None:
    rng = random.Random(seed)  # noqa: S311  calls by chance
    host = start(name, drive)
    states: list[Any] = []
    for k in range(400):
        _call(host, rng, states)
        assert all(math.isfinite(value) for value in host.outputs()), k
    assert not [text for _, text in host.messages if "defect" in text]


FORGED = [{"token": None}, {"inputs": [[]]}, {"inputs": []}, {"history": 7}, {"committed": "x"}, {"tolerance": "x"}]


@pytest.mark.parametrize("content", [[], {}, None, 7, *FORGED])
def test_forged_states_are_refused(start: Start, content: Any) -> None:
    host = start()
    slave_class = _slave_class(host)
    before = host.outputs()
    if content in FORGED:
        content = json.loads(host.serialize(host.state())[32:]) | content
    host.restore(host.deserialize(slave_class._fmu_state_to_bytes(content)))
    assert host.outputs() == before
    assert "state is damaged" in host.messages[-1][1]
    assert host.step(0.0, 0.1) == DISCARD
    assert host.step(0.0, 0.1) == OK


def _slave_class(host: Host) -> Any:
    """The slave's class; its module's name carries a hash."""
    modules = [module for name, module in list(sys.modules.items()) if name.endswith("_slave")]
    classes = [module.Slave for module in modules if hasattr(module, "Slave")]
    return next(one for one in classes if one.layout.token == host.about.token)


def test_percent_signs_and_hashes_in_messages_are_doubled(start: Start) -> None:
    slave = _slave_class(start())(instance_name="x", resources=".")
    slave.log("100% of %n %s, #r1#")
    assert [message.msg for message in slave._get_log_queue()] == ["100%% of %%n %%s, ##r1##"]


def test_the_callbacks_of_kinfmu_undo_the_doubling(start: Start) -> None:
    from kinfmu.fmu.host.slaves import fmi2_callbacks

    heard: list[tuple[int, str]] = []
    host = start()
    fmi2_callbacks(lambda *message: heard.append(message)).logger(None, b"x", 1, b"", b"100%% of ##r1##")
    host.set({"crank_angle": math.nan})
    assert heard == [(1, "100% of #r1#")]


def _counting(run: Callable[..., object], name: str, calls: dict[str, int]) -> Callable[..., object]:
    def counting(*args: object) -> object:
        calls[name] = calls.get(name, 0) + 1
        return run(*args)

    return counting


def _counted(monkeypatch: pytest.MonkeyPatch, host: Host) -> dict[str, int]:
    """How often the slave's solver is called from here on; its modules are those inside the FMU."""
    (solver,) = {
        module.Solver
        for name, module in sys.modules.items()
        if name.startswith(f"kinfmu_{host.about.interface.name}_{host.about.token[1:9]}")
        and name.endswith("python.solver")
    }
    assert solver is not Solver
    calls: dict[str, int] = {}
    for method in ("solve", "outputs", "rates", "accelerations", "errors", "margin"):
        monkeypatch.setattr(solver, method, _counting(getattr(solver, method), method, calls))
    return calls


def test_unchanged_input_is_not_solved_again_and_stages_are_computed_when_read(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    host = start()
    host.set({"crank_angle": 0.5})
    calls = _counted(monkeypatch, host)
    assert host.get("coupler.x") == pytest.approx([1 + math.cos(0.5)])
    assert calls == {"solve": 1, "outputs": 1}
    host.get("coupler.x", "rocker.phi")
    host.set({"crank_angle": 0.5})
    host.get("coupler.x")
    assert calls == {"solve": 1, "outputs": 1}
    host.get("coupler.vx")
    assert calls == {"solve": 1, "outputs": 1, "rates": 1}
    assert host.step(0.0, 0.1) == OK
    host.get("coupler.x", "coupler.vx", "coupler.ax")
    assert calls == {"solve": 1, "outputs": 1, "rates": 1, "accelerations": 1}


def test_restored_state_includes_parameters_refusals_and_time(start: Start) -> None:
    host = start("fourbar", "time")
    host.set({"crank.speed": 0.3})
    assert host.step(0.0, 2.0) == OK
    host.set({"crank_angle": math.nan})
    state = host.state()
    assert host.step(2.0, 1.0) == DISCARD
    host.set({"crank.speed": 0.1})
    assert host.step(2.0, 1.0) == OK
    host.restore(state)
    assert host.get("crank.phi", "crank.speed") == pytest.approx([0.6, 0.3])
    assert host.step(2.0, 1.0) == DISCARD
    host.free_state(state)


def test_state_of_another_fmu_is_refused(start: Start) -> None:
    host, other = start("fourbar"), start("double_pendulum")
    data = other.serialize(other.state())
    before = host.outputs()
    host.restore(host.deserialize(data))
    host.restore(host.deserialize(b"no state"))
    assert host.outputs() == before  # the binary passes messages on in the next call
    assert [text.partition(" ")[0] for _, text in host.messages] == ["state", "state"]
    assert host.step(0.0, 0.1) == DISCARD


def test_unknown_value_reference_is_an_error_message(start: Start) -> None:
    host = start()
    (value,) = host.fmu.getReal([9999])
    assert math.isnan(value)
    assert host.messages[-1] == (3, "value reference 9999 is not a Real variable of this FMU")
    assert host.step(0.0, 0.1) == OK


def test_one_process_can_have_many_slaves_in_turn(start: Start) -> None:
    for k in range(8):
        host = start()
        host.set({"crank_angle": 0.1 * k})
        assert host.get("crank.phi") == [0.1 * k]


def test_fixed_parameters_and_outputs_are_refused_after_initialization_too(start: Start) -> None:
    host = start("fourbar", "inputs")
    before = host.outputs()
    for values in ({"coupler.x": 7.0}, {"solver.residual": 1.0}, {"driven_by_time": True}, {"crank.x": 3.0}):
        host.set(values)
        (name,) = values
        assert host.outputs() == before  # the binary passes messages on in the next call
        assert host.messages[-1][0] == 3
        assert host.messages[-1][1].startswith(name)
        assert host.step(0.0, 0.1) == DISCARD
        assert host.messages[-1][1].startswith(f"at t = 0 s: {name}")
    assert host.step(0.0, 0.1) == OK
