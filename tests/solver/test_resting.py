"""Unknowns that rest: bodies that translate, held by pins and by bars, over random grids and under torques."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

import kinfmu
from kinfmu import AngleDriver, Body, ConstantSpeed, Distance, Mechanism, Revolute, Translational
from kinfmu.arrays import FloatArray
from kinfmu.codegen.python import load_model
from kinfmu.plan import compile_plan
from kinfmu.solver.python import Solver

Engine = Literal["python", "native"]
ENGINES: tuple[Engine, ...] = ("python", "native")
GRIDS = 250  # random ones, of each mechanism
START = 0.4  # [rad]
BAR, PINS = 0.5, ((2.0, 0.0), (1.0, -1.0))  # of the table
AT_CROSSING = 0.11  # [rad] from a change point; the only places where a sample may be less than ok


def table(pins: Sequence[tuple[float, float]] = PINS, bar: float = BAR, *, arm: str = "") -> Mechanism:
    """A table on a crank about (0, 0) and on parallel bars from the ground; arm: the body that carries a driven one."""
    bars = {f"L{k}": pin for k, pin in enumerate(pins)}
    at = bar * math.cos(START), bar * math.sin(START)
    bodies = [
        Body("ground", {"O": (0, 0), "W": (0.3, 0.7), **bars}),
        Body("crank", {"O": (0, 0), "P": (bar, 0)}, (0, 0, START)),
        Body("plate", {"P": (0, 0), "W": (0.3, 0.7), **bars}, (*at, 0.0)),
    ]
    joints = [Revolute("O", ("ground.O", "crank.O")), Revolute("P", ("crank.P", "plate.P"))]
    joints += [Distance(name, (f"ground.{name}", f"plate.{name}"), bar) for name in bars]
    drivers = [AngleDriver("crank", "crank", ConstantSpeed(START, 1.0))]
    if arm:
        x, y = at if arm == "plate" else (0.0, 0.0)
        bodies.append(Body("arm", {"W": (0, 0)}, (x + 0.3, y + 0.7, START)))
        joints.append(Revolute("W", (f"{arm}.W", "arm.W")))
        drivers.append(AngleDriver("arm", "arm", ConstantSpeed(START, 1.0)))
    return Mechanism("table", bodies, joints, drivers)


def resting_slide() -> Mechanism:
    """A crank and a rod as long, folded back on it: the block rests on the pivot."""
    return Mechanism(
        "resting_slide",
        [
            Body("ground", {"O": (0, 0), "way": (0, 0)}),
            Body("crank", {"O": (0, 0), "P": (1, 0)}, (0, 0, START)),
            Body("block", {"S": (0, 0)}, (0, 0, 0)),
        ],
        [
            Revolute("O", ("ground.O", "crank.O")),
            Translational("slide", ("ground.way", "block.S"), 0.0, 0.0),
            Distance("rod", ("crank.P", "block.S"), 1.0),
        ],
        [AngleDriver("crank", "crank", ConstantSpeed(START, 1.0))],
    )


def never(u: FloatArray) -> FloatArray:
    return np.ones(len(u))


def from_line(u: FloatArray) -> FloatArray:
    return np.abs(np.sin(u))


def from_upright(u: FloatArray) -> FloatArray:
    return np.abs(np.cos(u))


MECHANISMS: dict[str, tuple[Callable[[], Mechanism], Callable[[FloatArray], FloatArray]]] = {
    "table": (table, never),
    "parallelogram": (lambda: table(PINS[:1]), from_line),
    "table with a driven arm": (lambda: table(arm="plate"), never),
    "table next to a driven arm": (lambda: table(arm="ground"), never),
    "slide": (resting_slide, from_upright),
}


def random_grids(seed: int) -> list[FloatArray]:
    """Grids of one step or of random ones, of 1e-3 to 3 rad, there or there and back."""
    rng, found = np.random.default_rng(seed), []
    for _ in range(GRIDS):
        count, step = int(rng.integers(5, 40)), 10.0 ** rng.uniform(-3.0, 0.5) * rng.choice((1.0, -1.0))
        steps = step * (rng.uniform(0.2, 1.0, count) if rng.random() < 0.5 else np.ones(count))
        u = rng.uniform(-7.0, 7.0) + np.cumsum(steps)
        found.append(np.concatenate([u, u[::-1]]) if rng.random() < 0.3 else u)
    return found


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", MECHANISMS)
@pytest.mark.few(1)
def test_bodies_that_translate_are_followed_over_every_grid(name: str, engine: Engine) -> None:
    build, from_crossing = MECHANISMS[name]
    model = kinfmu.compile(build(), engine=engine)
    for u in random_grids(len(name)):
        run = model.solve(crank_angle=u, **({"arm_angle": 0.7 * u} if "arm" in name else {}))
        x, y, phi = BAR * np.cos(u), BAR * np.sin(u), 0.0 * u
        exact = {"block.x": phi} if name == "slide" else {"plate.x": x, "plate.y": y, "plate.phi": phi}
        assert set(run.status.tolist()) <= {0, 1, 2}
        assert (run.status[from_crossing(u) > math.sin(AT_CROSSING)] == 0).all()
        for column, values in exact.items():
            assert (np.abs(run[column] - values) <= 3.0 * run.error[:, 0] + 1e-15).all(), column
        rates = "block.vx" if name == "slide" else "plate.omega"
        assert np.abs(run[rates]).max() < 1e-11


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("pins", [PINS, PINS[:1]])
@pytest.mark.few(2)
def test_a_resting_body_is_followed_through_its_change_points_in_thousands_of_samples(
    pins: Sequence[tuple[float, float]], engine: Engine
) -> None:
    u = START + np.linspace(0.0, 4.0 * math.pi, 4001)
    run = kinfmu.solve(table(pins), engine=engine, crank_angle=u)
    assert run.good.all()
    assert np.abs(run["plate.phi"]).max() < 1e-13


@pytest.mark.parametrize(("flavour", "fmi"), [("python", 2), ("native", 2), ("native", 3)])
@pytest.mark.parametrize("name", ["table", "parallelogram", "slide"])
@pytest.mark.few(1)
def test_fmus_follow_what_rests(
    name: str, flavour: Literal["python", "native"], fmi: Literal[2, 3], tmp_path: Path
) -> None:
    built = kinfmu.build(MECHANISMS[name][0](), tmp_path / "rests.fmu", flavour=flavour, fmi=fmi)
    run = kinfmu.simulate(built, stop=12.6, step=0.0371)
    assert set(run.status.tolist()) <= {0, 1, 2}
    assert np.abs(run["block.x" if name == "slide" else "plate.phi"]).max() < 1e-13


@pytest.mark.parametrize("pins", [PINS, PINS[:1]])
def test_a_table_moved_by_its_weight_keeps_its_energy(pins: Sequence[tuple[float, float]]) -> None:
    """It swings as a point mass at the crank's pin does: phi' = sqrt(2 g / l (sin phi0 - sin phi)) at speed 0 there."""
    plain = table(pins)
    heavy = [replace(body, mass=2.0, inertia=0.1) if body.name == "plate" else body for body in plain.bodies]
    mechanism = replace(plain, bodies=tuple(heavy), gravity=(0.0, -9.81))
    run = kinfmu.simulate(mechanism, drive="torque", stop=3.0, step=0.01)
    assert run.good.all()
    assert np.abs(run["plate.phi"]).max() < 1e-12
    fallen = math.sin(START) - np.sin(run["crank_angle"])
    speed = np.sqrt(np.maximum(2.0 * 9.81 / BAR * fallen + run["crank_speed"][0] ** 2, 0.0))
    assert np.abs(run["crank_speed"]) == pytest.approx(speed, abs=1e-6)


def test_steps_across_a_change_point_never_land_on_the_branch_that_crosses() -> None:
    """At a change point of a parallelogram the crossed one leaves, on which the plate turns."""
    solver = Solver(load_model(compile_plan(table(PINS[:1]), ["plate.phi"])))
    rng = np.random.default_rng(3)
    for _ in range(400):
        before, after = (10.0 ** rng.uniform(-8.0, -1.0) for _ in range(2))
        pose = solver.solve(solver.anchor, (math.pi - before,))
        pose = solver.solve(pose, (math.pi + after,))
        assert pose.good
        assert abs(solver.outputs(pose)[0]) < 1e-12
