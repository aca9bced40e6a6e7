"""Mechanisms of the gallery by name, and chains of any length."""

from __future__ import annotations

import math
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.codegen.python import emit
from kinfmu.errors import AssemblyError, MechanismError, RequestError
from kinfmu.mechanism import Mechanism, gallery
from kinfmu.mechanism.gallery.chains import fourbar_chain, open_chain
from kinfmu.mechanism.joints import Distance
from kinfmu.plan import compile_plan
from kinfmu.plan.equations.redundancy import find_redundancy
from kinfmu.plan.equations.system import System
from tests.gallery_members import every_member


def test_the_two_reference_mechanisms_are_in_the_gallery() -> None:
    assert {"fourbar", "double_pendulum"} <= set(gallery.names())
    assert gallery.names() == sorted(gallery.names())


@pytest.mark.parametrize("name", gallery.names())
def test_a_mechanism_of_the_gallery_has_its_folders_name_a_title_and_a_comment(name: str) -> None:
    mechanism = gallery.load(name)
    assert mechanism.name == name
    assert mechanism.title
    assert (gallery.folder() / name / "mechanism.toml").read_text(encoding="utf-8").startswith("# ")


def test_an_unknown_name_suggests_a_known_one() -> None:
    with pytest.raises(RequestError) as caught:
        kinfmu.load("forbar")
    assert str(caught.value) == (
        "'forbar' is not in the gallery; did you mean 'fourbar'?; "
        f"gallery: {', '.join(gallery.names())}; files end in .toml"
    )
    with pytest.raises(RequestError, match=r"^'' is not in the gallery; gallery: "):
        kinfmu.load("")


def test_a_mechanism_is_loaded_from_a_file_by_text_or_path(tmp_path: Path) -> None:
    mechanism = kinfmu.load("fourbar")
    path = kinfmu.save(mechanism, tmp_path / "mine.toml")
    assert path == tmp_path / "mine.toml"
    assert kinfmu.load(path) == kinfmu.load(str(path)) == mechanism
    other = tmp_path / "no_suffix"
    kinfmu.save(mechanism, other)
    assert kinfmu.load(other) == kinfmu.load(str(other)) == mechanism


def test_saving_to_an_unwritable_path_is_an_error(tmp_path: Path) -> None:
    mechanism = kinfmu.load("fourbar")
    (tmp_path / "file").write_text("")
    path = tmp_path / "file" / "mine.toml"
    with pytest.raises(MechanismError) as caught:
        kinfmu.save(mechanism, path)
    assert str(caught.value) == f"{path}: cannot be written (Not a directory)"


def test_a_saved_file_has_the_same_bytes_on_every_system(tmp_path: Path) -> None:
    content = kinfmu.save(kinfmu.load("fourbar"), tmp_path / "mine.toml").read_bytes()
    assert b"\r" not in content
    assert content.endswith(b'\n[outputs]\ncoordinates = "moving"\n')


@pytest.mark.parametrize("purpose", ["check", "solve", "build"])
def test_a_name_in_place_of_a_mechanism_is_refused(purpose: str) -> None:
    door = getattr(kinfmu, purpose)
    with pytest.raises(RequestError) as caught:
        door("fourbar")
    assert str(caught.value) == f"{purpose} needs a Mechanism: kinfmu.load('fourbar') gives it"
    with pytest.raises(
        RequestError, match=f"^{purpose} needs a Mechanism, not dict; kinfmu.load gives one by its name$"
    ):
        door({})


def test_simulate_reports_that_a_mechanism_is_built_first() -> None:
    with pytest.raises(
        RequestError,
        match=r"^simulate steps an FMU; build\(mechanism\) makes one of mechanism 'fourbar'; .*drive='torque'\)",
    ):
        kinfmu.simulate(kinfmu.load("fourbar"))


# --------------------------------------------------------------------------------------------------------------- chains


EMIT = import_module("kinfmu.codegen.python.emit")  # the package shows a function of that name


@pytest.mark.parametrize("count", [1, 2, 9, 49, 50, 51])
@pytest.mark.few(2)
def test_all_bars_of_a_chain_of_parallelograms_stay_parallel(count: int) -> None:
    run = kinfmu.solve(fourbar_chain(count))
    u = run["crank_angle"]
    assert (run.status == 0).all()
    for k in range(1, count + 1):
        np.testing.assert_allclose(run[f"bar_{k}.phi"], u, rtol=0, atol=1e-12)
        np.testing.assert_allclose(run[f"bar_{k}.omega"], 1.0, rtol=0, atol=1e-12)
        np.testing.assert_allclose(run[f"coupler_{k}.x"], k - 1 + np.cos(u), rtol=0, atol=1e-12)
        np.testing.assert_allclose(run[f"coupler_{k}.vy"], np.cos(u), rtol=0, atol=1e-12)
        np.testing.assert_allclose(run[f"coupler_{k}.ax"], -np.cos(u), rtol=0, atol=1e-11)
    np.testing.assert_allclose(run["end.ay"], -np.sin(u), rtol=0, atol=1e-11)


def test_each_link_of_an_open_chain_follows_from_the_one_before() -> None:
    count = 50
    run = kinfmu.solve(open_chain(count))
    bend = 0.5 * math.pi / count
    phi = run["crank_angle"][:, None] + bend * np.arange(count)
    assert run.iterations.max() == 0
    np.testing.assert_allclose(run[f"link_{count}.phi"], phi[:, -1], rtol=0, atol=1e-13)
    np.testing.assert_allclose(run["end.x"], np.cos(phi).sum(axis=1), rtol=0, atol=1e-12)
    np.testing.assert_allclose(run["end.ay"], -np.sin(phi).sum(axis=1), rtol=0, atol=1e-12)


def test_identical_blocks_share_one_function() -> None:
    few, many = (emit(compile_plan(fourbar_chain(count))) for count in (80, 81))
    assert few.count("def position") == many.count("def position")
    assert "# 78 units of kind _4" in few
    assert "# 79 units of kind _4" in many
    assert emit(compile_plan(fourbar_chain(3))).count("def position") == 1


@pytest.mark.parametrize("drive", [{"t": np.linspace(0.0, 1.5, 7)}, {"crank_angle": np.linspace(2.8, 3.3, 11)}])
def test_loops_over_tables_and_unrolled_code_agree_to_the_bit(
    monkeypatch: pytest.MonkeyPatch, drive: dict[str, np.ndarray]
) -> None:
    unrolled = kinfmu.solve(fourbar_chain(12), **drive)
    monkeypatch.setattr(EMIT, "MANY", 0)
    looped = kinfmu.solve(fourbar_chain(12), **drive)
    for name in ("values", "rates", "accelerations", "residual", "margin", "error", "status"):
        np.testing.assert_array_equal(getattr(looped, name), getattr(unrolled, name))


@every_member
@pytest.mark.few(4)
def test_loops_over_tables_serve_any_mechanism(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """Units of their own, several drivers, parameters, triads, rows set aside, points of interest."""
    mechanism = kinfmu.load(name)
    t = np.linspace(0.0, 0.1, 5)
    unrolled = kinfmu.solve(mechanism, t)
    monkeypatch.setattr(EMIT, "MANY", 0)
    looped = kinfmu.solve(mechanism, t)
    for part in ("values", "rates", "accelerations"):
        expected = getattr(unrolled, part)
        scale = np.abs(expected).max(axis=0)
        assert (np.abs(getattr(looped, part) - expected) <= 1e-13 * np.maximum(scale, scale.max())).all()
    np.testing.assert_array_equal(looped.iterations, unrolled.iterations)
    np.testing.assert_array_equal(looped.watch, unrolled.watch)


def test_bridges_hold_blocks_in_loops_too() -> None:
    through = np.linspace(3.0, 3.3, 31)  # all loops are singular together at pi
    run = kinfmu.solve(fourbar_chain(60), crank_angle=through)
    assert (run.status <= 2).all()
    np.testing.assert_allclose(run["bar_60.phi"], through, rtol=0, atol=1e-12)
    np.testing.assert_allclose(run["bar_60.omega"], 1.0, rtol=0, atol=1e-10)


def test_one_output_of_the_first_loop_needs_the_first_loop_only() -> None:
    alone, first = (emit(compile_plan(fourbar_chain(count), ["bar_1.phi"])) for count in (1, 40))
    assert "bar_2_phi" not in first
    assert first.count("\n") <= alone.count("\n")


def test_the_gallery_gives_a_chain_of_any_length() -> None:
    assert kinfmu.load("fourbar_chain:5") == fourbar_chain(5)
    assert kinfmu.load("open_chain:3") == open_chain(3)
    assert kinfmu.load("fourbar_chain") == fourbar_chain(4)
    with pytest.raises(RequestError, match="whole number from 1 to 10000"):
        kinfmu.load("fourbar_chain:many")


def test_a_large_mechanism_that_does_not_assemble_in_order_is_reported_with_the_reason() -> None:
    chain = fourbar_chain(150)
    joints = (*chain.joints, Distance("brace", ("ground.O_0", "bar_150.P"), 150.0))
    with pytest.raises(AssemblyError, match=r"more than 900.*rows to spare: .*brace"):
        find_redundancy(System(Mechanism("braced", chain.bodies, joints, chain.drivers)))
