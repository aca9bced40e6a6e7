"""Laws over quantities of the pose: however coarse the samples, a path passes over no part of a law unseen."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinfmu
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.toml_file import parse

ENGINES = ("python", "native")
GROUND, ARM, COUPLER, FOLLOWER = 30.0, 60.0, 70.0, 65.0  # a drag-link: all turn round
LINKAGE = """
name = "led"
[units]
length = "mm"
[bodies.ground]
points = {{ K = [0, 500], O = [0, 0], D = [{ground}, 0] }}
[bodies.crank]
points = {{ K = [0, 0] }}
[bodies.arm]
points = {{ O = [0, 0], A = [{arm}, 0] }}
start = {{ phi = "60 deg" }}
[bodies.coupler]
points = {{ A = [0, 0], B = [{coupler}, 0] }}
start = {{ phi = "-10 deg" }}
[bodies.follower]
points = {{ D = [0, 0], B = [{follower}, 0] }}
start = {{ x = {ground}, phi = "{phi} deg" }}
{bodies}
[joints]
K = {{ type = "revolute", between = ["ground.K", "crank.K"] }}
O = {{ type = "revolute", between = ["ground.O", "arm.O"] }}
A = {{ type = "revolute", between = ["arm.A", "coupler.A"] }}
B = {{ type = "revolute", between = ["coupler.B", "follower.B"] }}
D = {{ type = "revolute", between = ["ground.D", "follower.D"] }}
{joints}
[joints.law]
type = "coupling"
input = {{ measure = "{measure}", {of} }}
output = {{ measure = "angle", of = "arm" }}
{law}
[drivers.crank]
type = "angle"
of = "crank"
law = "constant_speed"
"""
LEVER = {  # a second four-bar, whose lever swings and leads the law
    "bodies": """
[bodies.rod]
points = { P = [0, 0], Q = [90, 0] }
start = { y = 500 }
[bodies.lever]
points = { Q = [0, 0], L = [60, 0] }
start = { x = 90, y = 500, phi = "100 deg" }
""",
    "joints": """
P = { type = "revolute", between = ["crank.P", "rod.P"] }
Q = { type = "revolute", between = ["rod.Q", "lever.L"] }
L = { type = "revolute", between = ["ground.L", "lever.Q"] }
""",
}


def linkage(law: str, of: str = 'of = "crank"', measure: str = "angle", **changed: Any) -> Mechanism:
    lengths = {"ground": GROUND, "arm": ARM, "coupler": COUPLER, "follower": FOLLOWER, "phi": 50.0}
    given = lengths | {"bodies": "", "joints": ""} | changed
    text = LINKAGE.format(law=law, of=of, measure=measure, **given)
    if given["bodies"]:
        text = text.replace("K = [0, 500]", "K = [0, 500], L = [100, 500]").replace(
            "points = { K = [0, 0] }", "points = { K = [0, 0], P = [30, 0] }"
        )
    return parse(text)


def sequence(*segments: tuple[str, float, float], begin: float = 0.0, repeat: bool = True) -> str:
    """A law from 60 deg on; segments: law, duration and rise [rad]."""
    rows = [
        f'{{ law = "{law}", duration = {duration!r}{f", rise = {rise!r}" if law != "dwell" else ""} }}'
        for law, duration, rise in segments
    ]
    flag = "true" if repeat else "false"
    return f"law = 'sequence'\nstart = '60 deg'\nbegin = {begin!r}\nrepeat = {flag}\nsegments = [{', '.join(rows)}]"


def solved(mechanism: Mechanism, u: Sequence[float], engine: str) -> kinfmu.Run:
    return kinfmu.solve(mechanism, engine=engine, crank_angle=np.asarray(u, dtype=float))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("width", [0.5, 1e-2, 1e-4, 2e-7])
@pytest.mark.parametrize("turns", [1, -3])
@pytest.mark.few(1)
def test_a_rise_of_whole_turns_turns_all_that_follows(width: float, turns: int, engine: str) -> None:
    """From dwell to dwell: at both ends of a step slope and curvature are 0, and the linkage looks the same."""
    law = sequence(("dwell", math.tau - width, 0.0), ("cycloidal", width, turns * math.tau))
    rng = np.random.default_rng(28)
    for u in (np.array([6.0, 6.6]) - 0.5 * width, rng.uniform(-40.0, 40.0, 60), np.linspace(0.0, 60.0, 600)):
        run = solved(linkage(law), [0.1, *u], engine)
        dwells = (u % math.tau) < math.tau - width
        expected = run["follower.phi"][0] + turns * math.tau * np.floor(u / math.tau)
        assert run.status.tolist() == [0] * len(run.status)
        assert run["follower.phi"][1:][dwells] == pytest.approx(expected[dwells], abs=1e-9)


BUMPED = {"ground": 100.0, "arm": 60.0, "coupler": 40.0, "follower": 50.0, "phi": 100.0}


def limit_of_arm() -> float:
    """Where coupler and follower of the bumped linkage lie in line: |A D| = coupler + follower [rad]."""
    g, a, far = BUMPED["ground"], BUMPED["arm"], BUMPED["coupler"] + BUMPED["follower"]
    return math.acos((g * g + a * a - far * far) / (2.0 * g * a))


def cycloid(s: float) -> float:
    return s - math.sin(math.tau * s) / math.tau


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("width", [0.5, 1e-2, 1e-4, 2e-7])
@pytest.mark.few(1)
def test_a_bump_past_a_dead_centre_is_the_limit_on_every_grid(width: float, engine: str) -> None:
    begin, rise = 3.0, 0.4
    law = sequence(("cycloidal", width, rise), ("cycloidal", width, -rise), begin=begin, repeat=False)
    mechanism = linkage(law, **BUMPED)
    part = (limit_of_arm() - math.radians(60.0)) / rise
    low, high = 0.0, 1.0
    for _ in range(60):
        low, high = (low, 0.5 * (low + high)) if cycloid(0.5 * (low + high)) > part else (0.5 * (low + high), high)
    limit = begin + width * low
    rng = np.random.default_rng(5)
    for u in (
        [2.9, 3.1 + 2.0 * width],
        np.linspace(0.0, 6.0, 25),
        np.linspace(0.0, 6.0, 500),
        rng.uniform(0.0, 6.0, 40),
    ):
        run = solved(mechanism, u, engine)
        assert (run.status == 3).tolist() == (np.asarray(u) > limit).tolist()
    (reach,) = kinfmu.check(mechanism).ranges
    assert reach.high == pytest.approx(limit, abs=1e-9)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("width", [0.05, 1e-3, 1e-5])
@pytest.mark.few(1)
def test_rises_over_the_angle_of_a_lever_are_seen_also_where_it_turns_back(width: float, engine: str) -> None:
    """The law's whole turns of 0.01 rad before the lever's dead centre are passed there and back, within a step."""
    lever = linkage("law = 'constant_speed'", **LEVER)
    fine = np.linspace(0.0, math.tau, 20001)
    angle = solved(lever, fine, "native")["lever.phi"]
    highest = float(angle.max())
    top = float(fine[angle.argmax()])
    law = sequence(("cycloidal", width * 1e-2, math.tau), begin=highest - 1e-2 * width, repeat=False)
    half = linkage(law, 'of = "lever"', **LEVER)
    before, after = top - 0.09, top + 0.09
    run = solved(half, [top - 1.0, before, top, after, top + 1.0], engine)
    turned = run["follower.phi"] - run["follower.phi"][0]
    assert run.status.tolist() == [0] * 5
    assert turned == pytest.approx([0.0, 0.0, math.tau, 0.0, 0.0], abs=1e-2)
    bump = sequence(("cycloidal", width * 4e-3, 0.4), ("cycloidal", width * 4e-3, -0.4), begin=highest - 1e-2 * width,
                    repeat=False)  # fmt: skip
    run = solved(linkage(bump, 'of = "lever"', **BUMPED, **LEVER), [top - 1.0, before, after, top + 1.0], engine)
    assert run.status.tolist() == [0, 0, 3, 3]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("step", [0.05, 1.0, 7.0, 45.0])
@pytest.mark.parametrize("law", ["harmonic", "spline", "constant_speed"])
@pytest.mark.few(1)
def test_a_coupled_distance_that_would_be_negative_is_outside_on_every_grid(law: str, step: float, engine: str) -> None:
    spike = [[0, 1], [4.7, 1], [4.71, -0.01], [4.72, 1], [6.3, 1]]
    laws = {
        "harmonic": (
            'law = "harmonic"\namplitude = 1\nfrequency = 1\nstart = 0.9999',
            1.5 * math.pi - math.acos(0.9999),
        ),
        "spline": (f"law = 'spline'\npoints = {spike!r}", None),
        "constant_speed": ("law = 'constant_speed'\nstart = 1\nspeed = -0.25", 4.0),
    }
    written, limit = laws[law]
    mechanism = parse(f"""
name = "distance"
[bodies.ground]
points = {{ O = [0, 0] }}
[bodies.crank]
points = {{ O = [0, 0] }}
[bodies.slide]
points = {{ P = [0, 0] }}
start = {{ x = 1 }}
[joints]
O = {{ type = "revolute", between = ["ground.O", "crank.O"] }}
S = {{ type = "translational", between = ["ground.O", "slide.P"] }}
[joints.law]
type = "coupling"
input = {{ measure = "angle", of = "crank" }}
output = {{ measure = "distance", between = ["ground.O", "slide.P"] }}
{written}
[drivers.crank]
type = "angle"
of = "crank"
law = "constant_speed"
""")
    u = np.radians(np.arange(0.0, 360.0 + step, step))
    run = solved(mechanism, u, engine)
    if limit is None:
        limit = kinfmu.check(mechanism).ranges[0].high
        assert limit is not None
        assert 4.7 < limit < 4.71
    assert (run.status == 3).tolist() == (u > limit).tolist()
    assert "a distance would be negative" in run.events[0].text


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("grid", [[0.0, 1000.0], np.linspace(0.0, 1000.0, 12), np.linspace(0.0, 1000.0, 700)])
@pytest.mark.few(2)
def test_a_bump_of_a_linear_cam_past_a_dead_centre_is_the_limit(grid: Sequence[float], engine: str) -> None:
    """A cam on a slide lifts a bar of 100 mm on a crank of 50 mm; a bump of 60 mm would stretch them."""
    mechanism = parse("""
name = "linear_cam"
[units]
length = "mm"
[bodies.ground]
points = { O = [0, 0], S = [0, -50] }
[bodies.cam]
points = { S = [0, 0] }
start = { y = -50 }
[bodies.block]
points = { B = [0, 0] }
start = { x = 130 }
[bodies.crank]
points = { O = [0, 0], A = [50, 0] }
start = { phi = "60 deg" }
[bodies.bar]
points = { A = [0, 0], B = [100, 0] }
start = { x = 25, y = 43, phi = "-25 deg" }
[joints]
S = { type = "translational", between = ["ground.S", "cam.S"] }
G = { type = "translational", between = ["ground.O", "block.B"] }
O = { type = "revolute", between = ["ground.O", "crank.O"] }
A = { type = "revolute", between = ["crank.A", "bar.A"] }
B = { type = "revolute", between = ["bar.B", "block.B"] }
[joints.lift]
type = "coupling"
input = { measure = "position", between = ["ground.S", "cam.S"] }
output = { measure = "position", between = ["ground.O", "block.B"] }
law = "sequence"
start = 115
begin = 400
segments = [
    { law = "cycloidal", duration = 80, rise = 60 },
    { law = "cycloidal", duration = 80, rise = -60 },
]
[drivers.cam]
type = "slide"
between = ["ground.S", "cam.S"]
law = "constant_speed"
""")
    run = kinfmu.solve(mechanism, cam_position=np.asarray(grid), engine=engine)
    low, high = 0.0, 1.0
    for _ in range(60):
        low, high = (
            (low, 0.5 * (low + high)) if cycloid(0.5 * (low + high)) > 35.0 / 60.0 else (0.5 * (low + high), high)
        )
    assert (run.status == 3).tolist() == (np.asarray(grid) > 400.0 + 80.0 * low).tolist()


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.few(1)
def test_a_point_out_of_line_in_a_dense_table_is_seen(engine: str) -> None:
    """720 points in a turn of a slow wave; one of them 0.4 rad off, past the dead centre of the linkage."""
    x = np.radians(0.5 * np.arange(721))
    values = math.radians(60.0) + 0.02 * np.sin(x)
    bumped = values.copy()
    bumped[400] += 0.4
    for table, status in ((values, 0), (bumped, 3)):
        points = [[float(a), float(b)] for a, b in zip(x, table, strict=True)]
        run = solved(linkage(f"law = 'spline'\npoints = {points!r}", **BUMPED), [0.1, 3.4, 3.6], engine)
        assert run.status.tolist() == [0, 0, status]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.few(1)
def test_fast_harmonic_laws_are_seen_wave_by_wave(engine: str) -> None:
    """1000 waves of 0.4 rad in a turn: from zero to zero no step is as it seems."""
    law = "law = 'harmonic'\nstart = '60 deg'\namplitude = 0.4\nfrequency = 1000"
    run = solved(linkage(law, **BUMPED), [0.0, math.tau / 1000.0, 0.1 * math.tau], engine)
    assert run.status.tolist() == [0, 3, 3]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.few(1)
def test_parameters_of_laws_turn_what_follows_by_as_much(engine: str) -> None:
    """A rise before the start of the law grows from 0 to three turns: the linkage then looks the same."""
    law = "law = '3-4-5'\nstart = '60 deg'\nduration = 1\nbegin = -2\nrise = 'r'\n[parameters]\nr = '0 deg'"
    runs = [
        kinfmu.solve(linkage(law), parameters={"r": turns * math.tau}, crank_angle=[0.0], engine=engine)
        for turns in (0, 3, -2.5)
    ]
    angles = [float(run["follower.phi"][0]) for run in runs]
    assert angles[1] == pytest.approx(angles[0] + 3 * math.tau, abs=1e-9)
    assert angles[2] - angles[0] == pytest.approx(-2.5 * math.tau, abs=math.pi)


@pytest.mark.parametrize("engine", ENGINES)
def test_laws_led_by_one_of_several_drivers_are_seen(engine: str) -> None:
    """Each driver has its own machine, and a third arm is moved by both."""
    width = 1e-3
    law = sequence(("dwell", math.tau - width, 0.0), ("cycloidal", width, math.tau))
    text = LINKAGE.format(
        law=law,
        of='of = "crank"',
        measure="angle",
        bodies="[bodies.wheel]\npoints = { K = [0, 0] }\n[bodies.hand]\npoints = { W = [0, 0] }\n",
        joints=(
            'W = { type = "revolute", between = ["ground.K", "wheel.K"] }\n'
            'H = { type = "revolute", between = ["follower.D", "hand.W"] }\n'
        ),
        ground=GROUND,
        arm=ARM,
        coupler=COUPLER,
        follower=FOLLOWER,
        phi=50.0,
    )
    text += """
[drivers.wheel]
type = "angle"
of = "wheel"
law = "constant_speed"
[joints.both]
type = "coupling"
input = { measure = "angle", of = "wheel", to = "follower" }
output = { measure = "angle", of = "hand" }
law = "sequence"
segments = [{ law = "cycloidal", duration = 0.002, rise = 10 }]
begin = 1.5
"""
    u = np.array([0.1, 6.2, 6.4, 12.5, 12.6])
    wheel = np.array([0.0, 0.0, 9.0, 9.0, 15.0])
    run = kinfmu.solve(parse(text), crank_angle=u, wheel_angle=wheel, engine=engine)
    follower = run["follower.phi"]
    assert run.status.tolist() == [0] * 5
    assert follower == pytest.approx(follower[0] + math.tau * np.floor(u / math.tau), abs=1e-9)
    assert run["hand.phi"] == pytest.approx(np.where(wheel - follower > 1.502, 10.0, 0.0), abs=1e-9)


@pytest.mark.parametrize(("flavour", "fmi"), [("python", 2), ("native", 2), ("native", 3)])
@pytest.mark.few(1)
def test_fmus_step_over_no_rise(flavour: str, fmi: int, tmp_path: Path) -> None:
    """Communication points are in the dwells before and after a rise of a turn."""
    width = 1e-4
    law = sequence(("dwell", math.tau - width, 0.0), ("cycloidal", width, math.tau))
    built = kinfmu.build(linkage(law), tmp_path / "led.fmu", flavour=flavour, fmi=fmi)  # type: ignore[arg-type]
    run = kinfmu.simulate(built, start=0.0, stop=12.4, step=6.2, parameters={"crank.speed": 1.02})
    assert run.status.tolist() == [0, 0, 0]
    assert run["follower.phi"] == pytest.approx(run["follower.phi"][0] + math.tau * np.arange(3), abs=1e-9)
