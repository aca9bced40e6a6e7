"""A mechanism with its plain numbers as parameters moves as before, and as a file with other numbers does."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache, reduce
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu import Mechanism, Parameter, Run, Status
from kinfmu.draw.instant import instant
from kinfmu.errors import MechanismError, RequestError
from kinfmu.mechanism import gallery
from kinfmu.mechanism.members import NumberPath
from kinfmu.mechanism.opened import Opened, opened, place_text, with_open_numbers
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from kinfmu.page.describe import written_file
from kinfmu.page.module import page_module
from kinfmu.units import Quantity
from tests.page.engines import answers, driven_of, needs_node, rows_of, sweep_call, table

CLOSE = 1e-12  # of the size, or of a radian
MEMBERS = ("fourbar", "rack_steering", "cam_roller", "parallel_jaw")
PIN, ROD = "bodies.ground.points.C.y", "bodies.coupler.points.Q.x"  # of the crank-rocker


@cache
def of(name: str) -> tuple[Mechanism, Opened]:
    mechanism = kinfmu.load(name)
    return mechanism, opened(mechanism)


def with_number(mechanism: Mechanism, label: str, value: float) -> Mechanism:
    """Return the mechanism with another number at a place."""
    members = mechanism.members.changed(lambda place, old, _: value if place_text(place) == label else old)
    return replace(mechanism, bodies=members.bodies, joints=members.joints, loads=members.loads)


def worst_difference(run: Run, other: Run, size: float) -> float:
    """Return the largest difference, of each table relative to its largest number, in radians and sizes."""
    scales = np.array([1.0 if name.is_angle else size for name in run.outputs])
    tables = zip(
        (run.values, run.rates, run.accelerations), (other.values, other.rates, other.accelerations), strict=True
    )
    pairs = [(a / scales, b / scales) for a, b in tables]
    return max(float(np.nanmax(np.abs(a - b)) / max(1.0, np.nanmax(np.abs(a)))) for a, b in pairs)


@pytest.mark.parametrize("name", MEMBERS)
@pytest.mark.few(2)
def test_an_opened_mechanism_solves_to_the_same_numbers(name: str) -> None:
    mechanism, found = of(name)
    moving = replace(mechanism, coordinates="moving")
    t = np.linspace(mechanism.run.start, mechanism.run.stop, 50)
    run = kinfmu.solve(moving, t, engine="python")
    again = kinfmu.solve(replace(found.mechanism, coordinates="moving"), t, outputs=run.outputs, engine="python")
    assert run.status.tolist() == again.status.tolist()
    assert worst_difference(run, again, kinfmu.compile(moving).plan.size) < CLOSE


def test_every_plain_number_of_points_and_joints_is_open() -> None:
    mechanism, found = of("rack_steering")
    assert {"bodies.rack.points.left.y", "joints.way.axis", "joints.mesh.radius"} <= set(found.labels.values())
    assert not [name for name in found.mechanism.own_parameters if name not in found.places]
    left: list[NumberPath] = []
    found.mechanism.members.changed(
        lambda place, value, _: left.append(place) if type(value) is float and place[0] == "joints" else value
    )
    assert not left
    assert len(found.places) == 2 * len(mechanism.body_points) + sum(
        place[0] == "joints" for place in found.places.values()
    )


def test_expressions_stay_and_names_do_not_clash() -> None:
    leg = kinfmu.load("jansen_leg")
    leg = replace(leg, parameters={**leg.parameters, "opened_0": Parameter(1.0)})
    found = opened(leg)
    assert found.places["opened_0_"] == ("bodies", "ground", "points", "axle", 0)
    assert found.mechanism.parameters["left_x"] == leg.parameters["left_x"]
    assert "bodies.crank.points.X.x" not in found.labels.values()  # follows from m
    assert "bodies.crank.points.X.y" in found.labels.values()


@pytest.fixture(scope="module")
def crank_rocker(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    mechanism, found = of("crank_rocker")
    module = page_module(found.mechanism, found.labels)
    written = [one.value for one in (*module.plan.parameters, *module.plan.law_constants)]

    def bind(**changed: float) -> list[Any]:
        by_place = {PIN: changed.get("pin"), ROD: changed.get("rod")}
        return [by_place.get(name) or value for name, value in zip(module.parameters, written, strict=True)]

    run = kinfmu.solve(mechanism, np.linspace(0.0, 2.0, 361))
    sweep = sweep_call(module, driven_of(run))
    calls = [["bind", bind(pin=3.0, rod=48.0)], sweep, ["points"], ["bind", bind(rod=120.0)], ["points"]]
    (found_answers,) = answers(tmp_path_factory.mktemp("opened"), [(module, calls)])
    return {"answers": found_answers, "run": run, "mechanism": mechanism, "module": module}


@needs_node
def test_binding_a_length_equals_the_file_with_that_length(crank_rocker: dict[str, Any]) -> None:
    bind, sweep, points, *_ = crank_rocker["answers"]
    changed = with_number(with_number(crank_rocker["mechanism"], PIN, 3.0), ROD, 48.0)
    expected = kinfmu.solve(replace(changed, coordinates="moving"), np.linspace(0.0, 2.0, 361))
    rows, outputs = rows_of(expected), crank_rocker["module"].plan.outputs  # crank.x and crank.y among them
    found = table(sweep["values"], 3 * len(outputs))
    columns = [outputs.index(name) for name in expected.outputs]
    found = found[:, [order * len(outputs) + column for order in range(3) for column in columns]]
    assert bind == {"ok": True, "result": "bound", "message": ""}
    assert set(sweep["status"]) == {Status.OK}
    assert np.abs(found - rows).max() < CLOSE * np.abs(rows).max()
    assert np.array_equal(table(points, 2), list(changed.body_points.values()))


@needs_node
def test_lengths_that_do_not_close_are_named_by_their_places(crank_rocker: dict[str, Any]) -> None:
    *_, before, bind, after = crank_rocker["answers"]
    assert bind["ok"] is False
    assert bind["message"] == (
        f"parameters {ROD} = 120: the mechanism does not close: rows C.x, C.y leave a gap of 50 mm"
    )
    assert after == before


@needs_node
@pytest.mark.long
def test_masses_and_loads_that_are_set_give_the_forces_of_the_file(tmp_path: Path) -> None:
    set_to = {"bodies.ram.mass": 30.0, "loads.balance.stiffness": 4000.0, "loads.work.law.rise_1": -900.0}
    mechanism, found = of("toggle_press")
    module = page_module(found.mechanism, found.labels)
    written = [one.value for one in (*module.plan.parameters, *module.plan.law_constants)]
    assert set(set_to) <= set(module.parameters)
    values = [set_to.get(name, value) for name, value in zip(module.parameters, written, strict=True)]
    changed = reduce(lambda part, one: with_number(part, *one), set_to.items(), mechanism)
    times = np.linspace(mechanism.run.start, mechanism.run.stop, 25)
    run, before = kinfmu.solve(changed, times), kinfmu.solve(mechanism, times)
    u, ud, udd = (numbers.ravel().tolist() for numbers in driven_of(run))
    columns = [3 * len(module.plan.outputs) + k for k in range(len(module.forces))]
    calls = [["bind", values], ["sweep", u, columns, ud, udd, times.tolist()]]
    ((bind, sweep),) = answers(tmp_path, [(module, calls)])
    assert bind["ok"]
    scale = np.abs(run.forces).max()
    assert np.abs(run.forces - before.forces).max() > 0.01 * scale
    assert np.abs(table(sweep["values"], len(columns)) - run.forces).max() < 1e-9 * scale


def test_file_of_a_page_has_a_place_for_each_mass_and_load() -> None:
    mechanism, found = of("toggle_press")
    text = written_file(mechanism, page_module(mechanism), found.places)
    slots = set(re.findall(r"\{\{([\w.]+)\}\}", text))
    assert {"bodies.ram.mass", "loads.balance.stiffness", "loads.work.law.rise_1"} <= slots


def test_chosen_numbers_are_parameters_named_after_their_places() -> None:
    mechanism = kinfmu.load("fourbar_loaded")
    lengths = set(with_open_numbers(mechanism, "lengths").parameters) - {*mechanism.parameters}
    masses = set(with_open_numbers(mechanism, ["masses"]).parameters) - {*mechanism.parameters}
    points = {"ground.C.x", "crank.P.x", "coupler.Q.x", "rocker.Q.x"}
    assert lengths == {*points, "coupler.thickness", "coupler.width"}  # no zeros
    assert masses == {"crank.mass", "crank.inertia", "coupler.density", "rocker.mass", "rocker.inertia"}
    every = with_open_numbers(mechanism, "all")
    assert {*every.parameters} == {*mechanism.parameters} | lengths | masses | {"gravity.y"}
    some = with_open_numbers(mechanism, ["crank.O.y", "crank_center", "masses"])  # a zero, and a parameter of the file
    assert {*some.parameters} == {*mechanism.parameters} | masses | {"crank.O.y"}
    assert every.parameters["crank.P.x"] == Parameter(40.0, Quantity("length"), "Body crank: point P, x")
    assert every.parameters["gravity.y"].description == "Gravity: y"


@pytest.mark.parametrize("name", gallery.names())
def test_a_file_with_such_parameters_is_read_back(name: str) -> None:
    mechanism = with_open_numbers(kinfmu.load(name), "all")
    assert parse(text(mechanism)) == mechanism
    assert {*mechanism.in_metres().parameters} == {*mechanism.parameters}


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (
            "crank.Q.x",
            "there is no parameter 'crank.Q.x'; did you mean 'crank.P.x'?; parameters: all, lengths, ",
        ),
        ("masses", "parameters: mechanism 'fourbar' has no masses that are not parameters already"),
        ("crank.speed", "there is no parameter 'crank.speed'"),
    ],
)
def test_what_is_no_number_is_refused(names: str, message: str) -> None:
    with pytest.raises(RequestError) as refusal:
        with_open_numbers(kinfmu.load("fourbar"), names)
    assert str(refusal.value).startswith(message)
    assert "\n" not in str(refusal.value)


def test_a_coordinate_by_an_expression_names_it() -> None:
    leg = kinfmu.load("jansen_leg")
    message = r"^crank\.X\.x follows from 'm'; set the parameters in it$"
    with pytest.raises(RequestError, match=message):
        with_open_numbers(leg, "crank.X.x")
    with pytest.raises(RequestError, match=message):
        kinfmu.solve(leg, 0.0, parameters={"crank.X.x": 16.0})


def test_names_that_clash_are_refused() -> None:
    written = text(kinfmu.load("fourbar_loaded"))
    with pytest.raises(MechanismError, match=r"^\[parameters\] gravity.y: a body has a coordinate of this name"):
        with_open_numbers(parse(re.sub(r"(?<=[.\"])rocker\b", "gravity", written)), "all")
    points = written.replace("crank_center", "crank_middle").replace('["crank_middle"', "[1.0")
    points = points.replace("points = { O = [0.0, 0.0], P", "points = { center_of_mass = [1.0, 0.0], O = [0.0, 0.0], P")
    with pytest.raises(
        RequestError,
        match=r"^parameters: \[bodies.crank\] points.center_of_mass and \[bodies.crank\] center_of_mass would both be "
        "'crank.center_of_mass.x'; rename one$",
    ):
        with_open_numbers(parse(points), "all")
    for own, message in (
        ('"crank.speed" = 1.0', "crank.speed: the law of 'crank' has a constant of this name already"),
        ('"crank.P" = 1.0\ncrank_P = 2.0', "crank.P and crank_P differ only in dots and underscores; rename one"),
        ('"crank..P" = 1.0', "'crank..P' must consist of"),
    ):
        with pytest.raises(MechanismError, match=re.escape(f"[parameters] {message}")):
            parse(written.replace("[parameters]", f"[parameters]\n{own}"))


def far_crank_rocker() -> Mechanism:
    """Return a mechanism so far away that its plan has an origin of its own, where parameters are rounded otherwise."""
    mechanism = kinfmu.load("crank_rocker")
    for label, x in (("bodies.ground.points.O.x", 1e7), ("bodies.ground.points.C.x", 1e7 + 40.0)):
        mechanism = with_number(mechanism, label, x)
    return mechanism


@pytest.mark.parametrize("name", ["parallel_jaw", "toggle_press", "double_pendulum", "far"])
def test_what_a_report_has_found_gives_the_same_modules_and_the_same_drawing(name: str) -> None:
    mechanism = far_crank_rocker() if name == "far" else kinfmu.load(name)
    report, change = kinfmu.check(mechanism), opened(mechanism)
    assert page_module(mechanism, report=report).text == page_module(mechanism).text
    of_opened = page_module(change.mechanism, change.labels)
    assert page_module(change.mechanism, change.labels, report).text == of_opened.text
    drawn, alone = instant(mechanism, plan=report.plan), instant(mechanism)
    assert all(np.array_equal(drawn.poses[body], pose, equal_nan=True) for body, pose in alone.poses.items())
