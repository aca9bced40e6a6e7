"""Contract of loads, tested for all members of LOADS."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from kinfmu.mechanism import Body, Mechanism, Point
from kinfmu.mechanism.declared import keys_of
from kinfmu.mechanism.laws import ConstantValue, External
from kinfmu.mechanism.loads import LOADS, Damper, Following, ForceAlong, ForceAt, Load, Spring, TorsionDamper
from kinfmu.mechanism.quantities.placement import GROUND, BodyFrame, Placement
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from kinfmu.plan.equations.graph import evaluate
from kinfmu.plan.equations.system import placement
from kinfmu.plan.trace import Tracer
from kinfmu.units import Quantity
from tests.mechanism.joints.drawn import angles, coordinates
from tests.mechanism.loads.every_load import acting, are_apart, argument, in_si, mechanisms

AT_A_POINT = (ForceAt, ForceAlong)
every_load = pytest.mark.parametrize("cls", LOADS, ids=lambda cls: cls.type)
every_pair = pytest.mark.parametrize("cls", [cls for cls in LOADS if cls not in AT_A_POINT], ids=lambda cls: cls.type)
poses = st.lists(coordinates, min_size=9, max_size=9).map(np.array)
ROUNDING = 1e-12


@every_load
@given(data=st.data(), q=poses, qd=poses)
def test_the_power_of_a_conservative_load_is_minus_the_change_of_its_energy(
    cls: type[Load], data: st.DataObject, q: np.ndarray, qd: np.ndarray
) -> None:
    """The derivative of the energy along the motion is exact to round-off, by a complex step."""
    mechanism = data.draw(mechanisms(cls))
    (load,) = mechanism.loads
    assume(are_apart(mechanism, q))
    at = placement(mechanism, [complex(a, 1e-30 * b) for a, b in zip(q, qd, strict=True)])
    energy = complex(load.energy(in_si(mechanism, load.measured(at))))
    change = energy.imag / 1e-30
    if cls.energy is not Load.energy:
        now, at_rest = acting(mechanism, q, qd), acting(mechanism, q, 0.0 * qd)
        terms = np.abs(now.efforts) * (np.abs(now.gradients) @ np.abs(qd))
        assert now.power == pytest.approx(-change, rel=1e-9, abs=ROUNDING * max(terms))
        assert now.efforts == at_rest.efforts
    else:
        assert energy == 0.0


@every_load
@given(data=st.data(), q=poses, qd=poses)
def test_a_load_has_one_effort_and_kind_a_quantity(
    cls: type[Load], data: st.DataObject, q: np.ndarray, qd: np.ndarray
) -> None:
    mechanism = data.draw(mechanisms(cls))
    (load,) = mechanism.loads
    assume(are_apart(mechanism, q))
    does = acting(mechanism, q, qd)
    assert len(does.s) == len(does.efforts) == len(load.kinds())
    assert set(load.kinds()) <= {"length", "angle"}
    assert len(load.bodies()) == len(set(load.bodies()))
    assert set(load.acts_on()) <= set(load.bodies())
    moved = {mechanism.coordinate_names[k].owner for k in np.flatnonzero(np.abs(does.gradients).max(axis=0))}
    assert moved <= set(load.acts_on())


@pytest.mark.parametrize("cls", [Damper, TorsionDamper], ids=lambda cls: cls.type)
@given(data=st.data(), q=poses, qd=poses)
def test_a_damper_takes_power(cls: type[Load], data: st.DataObject, q: np.ndarray, qd: np.ndarray) -> None:
    mechanism = data.draw(mechanisms(cls))
    assume(are_apart(mechanism, q))
    does = acting(mechanism, q, qd)
    assert does.power == pytest.approx(-mechanism.loads[0].damping * does.sd[0] ** 2)  # type: ignore[attr-defined]


@every_load
@given(data=st.data(), q=poses, qd=poses, shift=st.tuples(coordinates, coordinates), turn=angles, drift=coordinates)
def test_a_load_is_the_same_for_an_observer_who_moves_uniformly(
    cls: type[Load],
    data: st.DataObject,
    q: np.ndarray,
    qd: np.ndarray,
    shift: tuple[float, float],
    turn: float,
    drift: float,
) -> None:
    """All bodies are moved by a shift and a turn and drift with one velocity: efforts between bodies stay the same.

    A force in the axes of a body turns with it.
    """
    mechanism = data.draw(mechanisms(cls, between=True))
    assume(are_apart(mechanism, q))
    c, s = math.cos(turn), math.sin(turn)
    turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    q_moved = (q.reshape(-1, 3) @ turned.T + [*shift, turn]).ravel()
    qd_moved = (qd.reshape(-1, 3) @ turned.T + [drift, -2.0 * drift, 0.0]).ravel()
    here, there = acting(mechanism, q, qd), acting(mechanism, q_moved, qd_moved)
    turns = cls in AT_A_POINT or getattr(mechanism.loads[0], "is_proportional", False)
    expected = turned[:2, :2] @ here.efforts if turns else np.array(here.efforts)
    size = 1.0 + np.abs(here.efforts).max() + np.abs([*q, *q_moved, *qd, *qd_moved]).max()
    np.testing.assert_allclose(there.efforts, expected, rtol=0.0, atol=1e-10 * size**2)


PROPORTIONAL = {"free_length": st.just(0.0), "preload": st.just(0.0)}


@given(data=st.data(), q=poses, qd=poses)
def test_a_spring_without_free_length_does_what_the_formula_with_a_direction_does(
    data: st.DataObject, q: np.ndarray, qd: np.ndarray
) -> None:
    """Both formulas agree where the ends are apart; a preload, here too small to count, needs a direction."""
    mechanism = data.draw(mechanisms(Spring, **PROPORTIONAL))
    (spring,) = mechanism.loads
    assume(are_apart(mechanism, q))
    directed = replace(mechanism, loads=(replace(spring, preload=1e-300),))
    assert (len(spring.kinds()), len(directed.loads[0].kinds())) == (2, 1)
    one, other = acting(mechanism, q, qd), acting(directed, q, qd)
    size = np.abs(other.generalized).max()
    np.testing.assert_allclose(one.generalized, other.generalized, rtol=0.0, atol=1e-12 * size)
    assert one.power == pytest.approx(other.power, rel=1e-9, abs=1e-12 * size * np.abs(qd).max())
    assert spring.energy(one.s) == pytest.approx(directed.loads[0].energy(other.s), rel=1e-12)


@every_pair
@given(data=st.data(), q=poses, qd=poses)
def test_what_a_load_does_to_two_bodies_cancels(
    cls: type[Load], data: st.DataObject, q: np.ndarray, qd: np.ndarray
) -> None:
    """Action is reaction: the generalized force does no work in a rigid motion of both bodies."""
    mechanism = data.draw(mechanisms(cls, between=True))
    assume(are_apart(mechanism, q))
    force = acting(mechanism, q, qd).generalized
    rigid = np.array([[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-y, x, 1.0]] for x, y, _ in q.reshape(-1, 3)])  # (b, 3, 3)
    work = rigid.transpose(1, 0, 2).reshape(3, -1) @ force
    np.testing.assert_allclose(work, 0.0, atol=ROUNDING * max(1.0, np.abs(force).max()) * 10.0)


@pytest.mark.parametrize("cls", AT_A_POINT, ids=lambda cls: cls.type)
@given(data=st.data(), q=poses)
def test_a_force_at_a_point_has_a_resultant_and_a_moment(cls: type[Load], data: st.DataObject, q: np.ndarray) -> None:
    mechanism = data.draw(mechanisms(cls, axes=st.just("ground")))
    assume(are_apart(mechanism, q))
    (load,) = mechanism.loads
    metre = 1e-3 if mechanism.length_unit == "mm" else 1.0
    does = acting(mechanism, q, 0.0 * q)
    (body,) = load.acts_on()
    k = [one.name for one in mechanism.moving_bodies].index(body)
    f_x, f_y = does.efforts
    point = placement(mechanism, list(q)).point(load.at)  # type: ignore[attr-defined]
    arm_x, arm_y = point[0] - q[3 * k], point[1] - q[3 * k + 1]
    expected = np.zeros(9)
    expected[3 * k : 3 * k + 3] = metre * np.array([f_x, f_y, arm_x * f_y - arm_y * f_x])
    np.testing.assert_allclose(does.generalized, expected, atol=1e-13 * (1.0 + np.abs(expected).max()))
    if isinstance(load, ForceAlong):
        x = argument(load, placement(mechanism, list(q)), 0.7)
        force = np.array([math.cos(load.angle), math.sin(load.angle)]) * load.effort(x)
    else:
        force = np.array([load.x, load.y])  # type: ignore[attr-defined]
    np.testing.assert_allclose([f_x, f_y], force, rtol=1e-12, atol=1e-12 * np.abs(force).max())


@every_load
@given(data=st.data(), q=poses, qd=poses)
def test_the_traced_graph_gives_the_bits_of_direct_evaluation(
    cls: type[Load], data: st.DataObject, q: np.ndarray, qd: np.ndarray
) -> None:
    mechanism = data.draw(mechanisms(cls))
    assume(are_apart(mechanism, q))
    q = q + 0.0  # -0 and 0 are one node
    does = acting(mechanism, q, qd)
    tracer = Tracer(mechanism)
    graph, (load,) = tracer.graph, tracer.members.loads
    frames = {
        body: BodyFrame.of(*(tracer.symbols[f"{body}.{axis}"] for axis in ("x", "y", "phi")))
        for body in ("left", "right", "third")
    }
    at = Placement({"ground": GROUND, **frames}, tracer.members.body_points)
    s = in_si(mechanism, load.measured(at))
    sd = [graph.symbol(f"rate{k}") for k in range(len(s))]
    nodes = load.efforts(at, s, sd, argument(load, at, graph.symbol("time")))
    values = dict(zip(mechanism.coordinate_names, map(float, q), strict=True)) | {"time": 0.7}
    values |= {f"rate{k}": float(rate) for k, rate in enumerate(does.sd)}
    traced = evaluate([*map(graph.lift, s), *map(graph.lift, nodes)], values)
    assert traced == [*does.s, *does.efforts]


@every_load
@given(data=st.data(), q=poses, qd=poses)
def test_a_load_is_the_same_in_a_file_in_mm(
    cls: type[Load], data: st.DataObject, q: np.ndarray, qd: np.ndarray
) -> None:
    """Lengths are a thousand times larger numbers; forces, torques and powers are the same numbers."""
    mechanism = replace(data.draw(mechanisms(cls, between=True)), length_unit="m")
    assume(are_apart(mechanism, q))
    (load,) = mechanism.loads
    lengths = [key.name for key in keys_of(type(load)) if key.measures == Quantity("length")]
    larger = replace(load, **{key: getattr(load, key) * 1e3 for key in lengths})  # type: ignore[type-var]
    bodies = tuple(
        Body(body.name, {name: Point(1e3 * p.x, 1e3 * p.y) for name, p in body.points.items()})
        for body in mechanism.bodies
    )
    in_mm = Mechanism("drawn", bodies, loads=(larger,), length_unit="mm")
    scale = np.tile([1e3, 1e3, 1.0], 3)
    here, there = acting(mechanism, q, qd), acting(in_mm, q * scale, qd * scale)
    size = 1.0 + np.abs(here.efforts).max()
    np.testing.assert_allclose(there.efforts, here.efforts, rtol=0.0, atol=1e-12 * size * 1e2)
    assert there.power == pytest.approx(here.power, rel=1e-9, abs=1e-9)
    energies = [one.loads[0].energy(does.s) for one, does in ((mechanism, here), (in_mm, there))]
    assert energies[1] == pytest.approx(energies[0], rel=1e-10, abs=1e-10)


@every_load
@given(data=st.data())
def test_a_load_is_the_same_after_writing_and_reading(cls: type[Load], data: st.DataObject) -> None:
    mechanism = data.draw(mechanisms(cls))
    again = parse(text(mechanism))
    assert again == mechanism
    assert hash(again) == hash(mechanism)
    assert text(again) == text(mechanism)


@pytest.mark.parametrize("cls", [cls for cls in LOADS if issubclass(cls, Following)], ids=lambda cls: cls.type)
@given(data=st.data(), x=coordinates)
def test_an_external_load_has_one_input_that_is_its_effort(cls: type[Any], data: st.DataObject, x: float) -> None:
    mechanism = data.draw(mechanisms(cls, over=st.none()))
    load = replace(mechanism.loads[0], law=External(2.0))  # type: ignore[type-var]
    (given,) = load.inputs()
    kind = "torque" if load.kinds() == ("angle",) else "force"
    assert given == f"member_{kind}"
    assert given.quantity == Quantity(kind)
    assert load.effort(x) == x
    assert replace(load, law=ConstantValue(2.0)).inputs() == ()
    assert replace(load, law=ConstantValue(2.0)).effort(x) == 2.0
