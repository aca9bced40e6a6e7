"""Native FMUs: invalid calls return Error with a message, and change nothing."""

from __future__ import annotations

import ctypes
import math
import random
from typing import Any

import pytest

from tests.fmu.conftest import Start
from tests.fmu.host import DISCARD, ERROR, OK, WARNING, Host, answer
from tests.fmu.test_python_slave import damaged


def component(host: Host) -> ctypes.c_void_p:
    return ctypes.c_void_p(getattr(host.fmu.component, "value", host.fmu.component))


def call(host: Host, name: str, *arguments: Any) -> int:
    """Status of a call of the library itself, past fmpy."""
    function = ctypes.CDLL(host.fmu.dll._name)[f"fmi{host.fmi}{name}"]
    return int(function(component(host), *arguments))


@pytest.mark.parametrize(("value", "h"), [(1e90, 1e30), (1e60, 1e50), (1.0, 1e101)])
def test_inputs_that_overflow_by_their_derivatives_are_discard(start: Start, fmi: int, value: float, h: float) -> None:
    if fmi == 3:
        pytest.skip("FMI 3.0 has no input derivatives")
    host = start()
    for order in (1, 2, 3):
        host.fmu.setRealInputDerivatives(host.of("crank_angle"), [order], [value])
    assert host.step(0.0, h) == DISCARD
    assert host.get("crank_angle") == [0.0]
    host.set({"crank_angle": 0.1})
    assert host.status() == 0


def test_every_changed_byte_of_a_state_is_detected(start: Start) -> None:
    host = start()
    for k in range(40):
        host.set({"crank_angle": 0.1 * k})
        assert host.step(0.1 * k, 0.1) == OK
    before = host.outputs()
    data = host.serialize(host.state())
    rng = random.Random(3)  # noqa: S311  damage by chance
    places = [*range(96), *rng.sample(range(len(data)), 600), len(data) - 1]
    for place in places:
        changed = bytearray(data)
        changed[place] ^= 1 << rng.randrange(8)
        assert answer(host.deserialize, bytes(changed)) == ERROR, place
    assert "the state is damaged, its checksum does not fit" in host.messages[-1][1]
    for _ in range(200):
        assert answer(host.deserialize, damaged(data, rng)) == ERROR
    assert host.outputs() == before
    host.restore(host.deserialize(data))
    assert host.outputs() == before


def test_a_state_of_the_other_kind_of_instance_is_refused(start: Start) -> None:
    slave, model = start(), start(model_exchange=True)
    for host, other in ((slave, model), (model, slave)):
        assert answer(host.restore, host.deserialize(other.serialize(other.state()))) == ERROR
        assert "the state is of an instance for " in host.messages[-1][1]
    assert slave.step(0.0, 0.1) == OK


@pytest.mark.parametrize("initialize", [False, True])
def test_set_time_is_for_model_exchange(start: Start, initialize: bool) -> None:
    slave, model = start(initialize=initialize), start(model_exchange=True)
    assert call(slave, "SetTime", ctypes.c_double(0.5)) == ERROR
    assert "this instance is for co-simulation, where doStep sets the time" in slave.messages[-1][1]
    assert call(model, "SetTime", ctypes.c_double(0.5)) == OK
    for value in (math.nan, math.inf):
        assert call(model, "SetTime", ctypes.c_double(value)) == ERROR
    assert call(model, "Terminate") == OK
    assert call(model, "SetTime", ctypes.c_double(0.6)) == ERROR


def test_arrays_that_are_null_are_an_error(start: Start, fmi: int) -> None:
    host = start()
    one, two = ctypes.c_size_t(1), ctypes.c_size_t(2)
    references = (ctypes.c_uint * 2)(1, 2)
    values = (ctypes.c_double * 2)()
    kinds = ["Real", "Integer", "Boolean", "String"]
    if fmi == 3:
        kinds = ["Float64", "Float32", "Int8", "Int32", "Int64", "UInt64", "Boolean", "String"]
    more = () if fmi == 2 else (two,)
    for word in ("Get", "Set"):
        for kind in kinds:
            assert call(host, f"{word}{kind}", None, two, values, *more) == ERROR, (word, kind)
            assert "NULL for an array" in host.messages[-1][1]
            assert call(host, f"{word}{kind}", references, two, None, *more) == ERROR, (word, kind)
            none = () if fmi == 2 else (ctypes.c_size_t(0),)
            assert call(host, f"{word}{kind}", None, ctypes.c_size_t(0), None, *none) == OK, (word, kind)
    counts = () if fmi == 2 else (one, None, one)
    directional = "GetDirectionalDerivative"
    if fmi == 2:
        assert call(host, directional, None, one, references, one, values, values) == ERROR
        assert call(host, directional, references, one, references, one, None, values) == ERROR
        assert call(host, "SetRealInputDerivatives", references, one, None, values) == ERROR
        assert call(host, "GetRealOutputDerivatives", references, one, None, values) == ERROR
        assert call(host, "GetRealStatus", 2, None) == ERROR
        assert call(host, "GetBooleanStatus", 3, None) == ERROR
    else:
        assert call(host, directional, None, one, references, one, values, *counts) == ERROR
        for name in (directional, "GetAdjointDerivative"):
            assert call(host, name, references, one, None, one, values, one, values, one) == ERROR
            assert call(host, name, references, one, references, one, None, one, values, one) == ERROR
        assert call(host, "GetOutputDerivatives", references, one, None, values, one) == ERROR
    on = ctypes.c_int(1) if fmi == 2 else ctypes.c_bool(True)
    assert call(host, "SetDebugLogging", on, one, None) == ERROR
    assert host.step(0.0, 0.1) == OK


@pytest.mark.parametrize("order", [0, -1, 3, 2**31 - 1, -(2**31)])
def test_invalid_orders_of_derivatives_are_an_error(start: Start, fmi: int, order: int) -> None:
    host = start()
    references = (ctypes.c_uint * 1)(host.references["coupler.x"])
    orders, values = (ctypes.c_int * 1)(order), (ctypes.c_double * 1)()
    one = ctypes.c_size_t(1)
    more = () if fmi == 2 else (one,)
    name = "GetRealOutputDerivatives" if fmi == 2 else "GetOutputDerivatives"
    assert call(host, name, references, one, orders, values, *more) == ERROR
    assert f"derivative of order {order}" in host.messages[-1][1]


def test_text_of_the_host_is_never_used_as_a_format(start: Start, fmi: int) -> None:
    from fmpy.fmi2 import fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
    from fmpy.fmi3 import fmi3LogMessageCallback

    host = start()
    library = ctypes.CDLL(host.fmu.dll._name)
    heard: list[bytes] = []
    token = host.about.token.encode()
    if fmi == 2:
        callbacks = fmi2CallbackFunctions()
        callbacks.logger = fmi2CallbackLoggerTYPE(lambda _host, _name, _status, _category, text: heard.append(text))
        library.fmi2Instantiate.restype = ctypes.c_void_p
        made = library.fmi2Instantiate(b"%n%s", 1, token, None, ctypes.byref(callbacks), 0, 1)
        switch: Any = ctypes.c_int(1)
    else:
        logger = fmi3LogMessageCallback(lambda _host, _status, _category, text: heard.append(text))
        create = library.fmi3InstantiateModelExchange
        create.restype = ctypes.c_void_p
        create.argtypes = [*[ctypes.c_char_p] * 3, *[ctypes.c_bool] * 2, *[ctypes.c_void_p] * 2]
        made = create(b"%n%s", token, None, False, True, None, ctypes.cast(logger, ctypes.c_void_p))
        switch = ctypes.c_bool(True)
    names = (ctypes.c_char_p * 2)(b"%n%n%s #r99# 100%", b"%" * 1000)
    turn = library[f"fmi{fmi}SetDebugLogging"]
    assert turn(ctypes.c_void_p(made), switch, ctypes.c_size_t(2), names) == WARNING
    if fmi == 2:  # there a message is a format
        assert b"'%%n%%n%%s ##r99## 100%%'" in heard[0]
        assert heard[1].count(b"%") % 2 == 0
    else:
        assert b"'%n%n%s #r99# 100%'" in heard[0]
    free = library[f"fmi{fmi}FreeInstance"]
    free.restype = None
    free(ctypes.c_void_p(made))
