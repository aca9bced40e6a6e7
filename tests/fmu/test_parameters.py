"""Parameters of a mechanism at run time: equal to a file with those numbers, or refused with the row and the gap."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Cycloidal, Distance, Gear, Mechanism, Revolute
from kinfmu.codegen.python import load_module
from kinfmu.errors import AssemblyError, FmuError, InconsistentError, KinfmuError, MechanismError, MobilityError
from kinfmu.fmu.build import FLAVOURS
from kinfmu.mechanism import Point
from kinfmu.mechanism.toml_file import parse
from kinfmu.plan import compile_plan
from kinfmu.solver.python import UnsolvableModel, with_parameters
from tests.mechanisms import PINS
from tests.oracle import fourbar as exact_fourbar

LENGTHS = {"ground": 4.0, "crank": 1.0, "coupler": 3.5, "rocker": 3.0}
OTHERS = {"ground": 4.2, "crank": 1.3, "coupler": 3.1, "rocker": 3.3}


def linkage(lengths: Mapping[str, float | str] = LENGTHS) -> Mechanism:
    """A four-bar whose lengths are parameters."""
    return Mechanism(
        "settable",
        [
            Body("ground", {"O": (0, 0), "C": ("ground", 0)}),
            Body("crank", {"O": (0, 0), "P": ("crank", 0)}, (0, 0, 1.0)),
            Body("coupler", {"P": (0, 0), "Q": ("coupler", 0), "M": ("coupler/2", "rocker/6")}, (0.5, 0.8, 0.6)),
            Body("rocker", {"C": (0, 0), "Q": ("rocker", 0)}, (4, 0, 1.8)),
        ],
        [*PINS],
        [AngleDriver("crank", "crank", ConstantSpeed(1.0, "1 rad/s"))],
        points={"M": "coupler.M"},
        parameters=dict(lengths),
        run=kinfmu.RunSettings(0.0, 6.0, 0.25),
    )


@pytest.fixture(scope="module", autouse=True, params=[200, 0], ids=["unrolled", "loops over tables"])
def code(request: pytest.FixtureRequest) -> Iterator[None]:
    """Both forms of generated code bind parameters."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(import_module("kinfmu.codegen.python.emit"), "MANY", request.param)
        yield


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return kinfmu.build(linkage(), tmp_path_factory.mktemp("parameters"))


def test_other_lengths_give_the_same_as_a_file_with_those_lengths(fmu: Path) -> None:
    written = kinfmu.solve(linkage(OTHERS))
    for run in (kinfmu.solve(linkage(), parameters=OTHERS), kinfmu.simulate(fmu, parameters=OTHERS)):
        assert run.outputs == written.outputs
        for got, wanted, within in (
            (run.values, written.values, 1e-13),
            (run.rates, written.rates, 1e-12),
            (run.accelerations, written.accelerations, 1e-11),
        ):
            np.testing.assert_allclose(got, wanted, rtol=0, atol=within)
        assert run.fixed == pytest.approx(written.fixed, abs=1e-15)
        assert run.mechanism  # pictures are drawn from it
        assert {name: one.value for name, one in run.mechanism.parameters.items()} == OTHERS


def test_other_lengths_agree_with_the_oracle() -> None:
    u = np.linspace(0.0, 6.2, 25)
    run = kinfmu.solve(linkage(), crank_angle=u, parameters=OTHERS)
    lengths = [OTHERS[name] for name in ("ground", "crank", "coupler", "rocker")]
    exact = exact_fourbar(*(repr(length) for length in lengths), u)
    np.testing.assert_allclose(run["coupler.phi"], exact.q[:, 1].astype(float), rtol=0, atol=1e-13)
    np.testing.assert_allclose(run["rocker.alpha"], exact.qdd[:, 2].astype(float), rtol=0, atol=1e-11)


def test_parameters_take_units_and_law_constants_are_set_the_same_way() -> None:
    run = kinfmu.solve(linkage(), [0.0, 1.0], parameters={"coupler": "3100 mm", "crank.speed": 2.0})
    assert run["crank.phi"].tolist() == [1.0, 3.0]
    np.testing.assert_allclose(
        np.hypot(run["M.x"] - run["coupler.x"], run["M.y"] - run["coupler.y"]), math.hypot(1.55, 0.5)
    )
    assert 'coupler = "3.1 m"' in run.mechanism_text


def test_a_derived_parameter_can_be_set_too() -> None:
    mechanism = replace(linkage(), parameters={**LENGTHS, "rocker": "crank*3"})
    run = kinfmu.solve(mechanism, parameters={"rocker": 3.2})
    np.testing.assert_array_equal(run.values, kinfmu.solve(linkage(), parameters={"rocker": 3.2}).values)
    # In the file from the start, the pose is not followed there from another length: it is rounded otherwise.
    in_file = kinfmu.solve(linkage({**LENGTHS, "rocker": 3.2}))
    np.testing.assert_allclose(run.values, in_file.values, rtol=0, atol=2e-15)


def test_lengths_that_do_not_close_are_refused_with_the_joint_and_the_gap(fmu: Path) -> None:
    gap = 9.0 - 3.0 - math.sqrt(1.0 + 16.0 - 8.0 * math.cos(1.0))  # coupler less rocker and what lies between the pins
    with pytest.raises(AssemblyError, match=rf"does not close: gap {gap:.4g} m"):
        kinfmu.solve(linkage(), parameters={"coupler": 9.0})
    with pytest.raises(FmuError) as refusal:
        kinfmu.simulate(fmu, parameters={"coupler": 9.0})
    assert str(refusal.value) == (
        f"parameters coupler = 9: the mechanism does not close: rows Q.x, Q.y leave a gap of {gap:.4g} m"
    )


@pytest.mark.few(1)
def test_a_redundant_bar_of_another_length_is_refused_with_its_row(tmp_path: Path) -> None:
    reference = kinfmu.load("fourbar")
    joints = tuple(replace(j, length="bar") if isinstance(j, Distance) else j for j in reference.joints)
    mechanism = replace(reference, joints=joints, parameters={"bar": 1.0})
    with pytest.raises(InconsistentError, match=r"\[joints.AB\].*: gap 0.01 m"):
        kinfmu.solve(mechanism, parameters={"bar": 1.01})
    for flavour in FLAVOURS:
        fmu = kinfmu.build(mechanism, tmp_path / f"{flavour}.fmu", flavour=flavour)
        with pytest.raises(FmuError, match=r"redundant row AB.length does not close: gap about 0.01005 m"):
            kinfmu.simulate(fmu, parameters={"bar": 1.01})


def geared() -> Mechanism:
    """Lengths, ratios and durations that are parameters."""
    return Mechanism(
        "geared",
        [
            Body("ground", {"O": (0, 0), "C": (4, 0)}),
            Body("crank", {"O": (0, 0), "P": (1, 0)}, (0, 0, 1.0)),
            Body("rocker", {"C": (0, 0), "Q": (3, 0)}, (4, 0, 1.8)),
            Body("wheel", {"C": (0, 0)}, (4, 0, 0)),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Revolute("C", ("ground.C", "rocker.C")),
            Revolute("W", ("ground.C", "wheel.C")),
            Distance("rod", ("crank.P", "rocker.Q"), "rod"),
            Gear("mesh", ("crank", "wheel"), ratio="teeth/20"),
        ],
        [AngleDriver("crank", "crank", Cycloidal(rise=1.0, duration="1/pace", start=1.0))],
        parameters={"rod": 3.5, "teeth": 40.0, "pace": 1.0},
    )


def test_numbers_that_are_invalid_in_a_file_are_refused_at_run_time(tmp_path: Path) -> None:
    mechanism = geared()
    fmu = kinfmu.build(mechanism, tmp_path)
    for name, value, reason in (
        ("rod", -3.5, "[joints.rod] length = -3.5 must be positive"),  # d.d = L^2 also holds for -L
        ("teeth", 0.0, "[joints.mesh] ratio = 0 must be other than 0"),
        ("pace", -2.0, "[drivers.crank] duration = -0.5 must be positive"),
        ("pace", 0.0, "they lead to numbers that are not finite"),
    ):
        with pytest.raises(FmuError) as refusal:
            kinfmu.simulate(fmu, parameters={name: value})
        assert str(refusal.value) == f"parameters {name} = {value:g}: {reason}"
        with pytest.raises(MechanismError):
            kinfmu.solve(mechanism, parameters={name: value})


@pytest.mark.few(1)
def test_lengths_of_zero_that_make_rows_dependent_are_refused(tmp_path: Path) -> None:
    lengths = {"ground": 2.0, "crank": 1.0, "coupler": 2.0, "rocker": 1.0}
    parallelogram = linkage(lengths)
    third = Body("third", {"G": (0, 0), "T": ("crank", 0)}, (1, 0, 1.0))
    ground, crank, *_ = parallelogram.bodies
    changed = replace(
        parallelogram,
        bodies=(
            Body("ground", {**ground.points, "G": (1.0, 0.0)}),
            crank,
            Body("coupler", {"P": (0, 0), "Q": ("ground", 0), "M": (1, 0)}, (0.5, 0.8, 0)),
            Body("rocker", {"C": (0, 0), "Q": ("crank", 0)}, (2, 0, 1.0)),
            third,
        ),
        joints=(
            *parallelogram.joints,
            Revolute("G", ("ground.G", "third.G")),
            Revolute("T", ("third.T", "coupler.M")),
        ),
    )
    with pytest.raises(FmuError, match=r"^parameters crank = 0: beyond a singular point, where rows "):
        kinfmu.simulate(kinfmu.build(changed, tmp_path), parameters={"crank": 0.0})
    with pytest.raises(MobilityError, match="mobility is 3"):
        kinfmu.solve(changed, parameters={"crank": 0.0})


def test_a_name_that_is_not_a_parameter_is_refused(fmu: Path) -> None:
    with pytest.raises(KinfmuError, match="there is no parameter 'copler'; did you mean 'coupler'"):
        kinfmu.solve(linkage(), parameters={"copler": 3.0})
    with pytest.raises(KinfmuError, match="there is no parameter 'copler'; did you mean 'coupler'"):
        kinfmu.simulate(fmu, parameters={"copler": 3.0})


def test_continuation_keeps_the_branch_where_assembly_would_take_the_nearest() -> None:
    """Lengths far from those written, step by step: the rocker pin stays on its side of the diagonal."""
    module = load_module(compile_plan(linkage()))
    for scale in (0.2, 1.0, 30.0):
        solver = with_parameters(module, tuple(scale * value for value in OTHERS.values()))
        assert not isinstance(solver, UnsolvableModel)
        exact = exact_fourbar(*(repr(OTHERS[name]) for name in ("ground", "crank", "coupler", "rocker")), [1.0])
        assert solver.anchor.z == pytest.approx([float(exact.q[0, 1]), float(exact.q[0, 2])], abs=1e-13)


def test_parameters_are_in_the_state_of_an_fmu_and_in_what_depends_on_them(fmu: Path) -> None:
    from fmpy import read_model_description

    described = read_model_description(str(fmu))
    by_name = {variable.name: variable for variable in described.modelVariables}
    assert by_name["coupler"].causality == "parameter"
    assert (by_name["coupler"].variability, by_name["coupler"].unit, by_name["coupler"].start) == ("fixed", "m", "3.5")
    unknown = {item.variable.name: item for item in described.initialUnknowns}
    assert {"coupler", "ground"} <= {variable.name for variable in unknown["rocker.phi"].dependencies}
    assert {variable.name for variable in unknown["rocker.x"].dependencies} == {"ground"}


def test_points_may_be_given_as_points() -> None:
    assert linkage().bodies[0].points["C"] == Point(4.0, 0.0)


def test_a_cam_whose_lift_would_not_close_after_a_turn_is_refused_at_run_time(tmp_path: Path) -> None:
    text = """
        name = "cam"
        [parameters]
        rise = "60 deg"
        dwell = "120 deg"
        lift = 10
        drop = 10
        [bodies.ground]
        points = { O = [0, 0] }
        [bodies.cam]
        points = { O = [0, 0] }
        [bodies.follower]
        points = { F = [0, 0] }
        start = { x = 0, y = 0, phi = 0 }
        [joints.O]
        type = "revolute"
        between = ["ground.O", "cam.O"]
        [joints.guide]
        type = "translational"
        between = ["ground.O", "follower.F"]
        axis = "90 deg"
        [joints.lift]
        type = "cam_translating"
        between = ["ground.O", "follower.F"]
        axis = "90 deg"
        cam = "cam"
        offset = 30
        law = "sequence"
        repeat = true
        segments = [
            { law = "cycloidal", rise = "lift", duration = "rise" },
            { law = "dwell", duration = "dwell" },
            { law = "cycloidal", rise = "-drop", duration = "rise" },
            { law = "dwell", duration = "dwell" },
        ]
        [drivers.cam]
        type = "angle"
        of = "cam"
        law = "constant_speed"
        speed = "60 deg/s"
        [run]
        stop = 6
        step = 0.5
    """
    mechanism = parse(text)
    fmu = kinfmu.build(mechanism, tmp_path)
    both = {"rise": math.radians(80.0), "dwell": math.radians(100.0)}
    np.testing.assert_allclose(
        kinfmu.simulate(fmu, parameters=both).values, kinfmu.solve(mechanism, parameters=both).values, atol=1e-12
    )
    for settings, reason in (
        ({"rise": both["rise"]}, "durations in all over a turn, less 1, = 0.1111111111"),
        ({"drop": 9.0}, "rises in all over their size = 0.0743"),
    ):
        with pytest.raises(FmuError, match=rf"\[joints.lift\] law: {re.escape(reason)}.* must be 0$"):
            kinfmu.simulate(fmu, parameters=settings)
        with pytest.raises(MechanismError, match="add up to"):
            kinfmu.solve(mechanism, parameters=settings)
