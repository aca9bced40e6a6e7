"""`measure_designs`: equal to `measure` of the run of every design, failures included."""

from __future__ import annotations

import gc
import math
import weakref
from dataclasses import replace

import numpy as np
import pytest

import kinfmu
from kinfmu.errors import KinfmuError, RequestError
from kinfmu.mechanism.measures import (
    READINGS,
    Dwell,
    LowestMargin,
    Maximum,
    MechanicalAdvantage,
    Minimum,
    PathDistance,
    Peak,
    PeakAcceleration,
    PeakSpeed,
    PressureAngle,
    Range,
    Reading,
    Roundness,
    Straightness,
    TimeRatio,
    TransmissionAngle,
    VelocityRatio,
)
from kinfmu.mechanism.quantities import AngleBetween, DistanceBetween
from kinfmu.mechanism.toml_file import parse
from kinfmu.motion import History, quintic
from kinfmu.motion.quintic import use_compiled
from tests.mechanisms import FOURBAR_DRIVER, FOURBAR_PINS

TURN = np.linspace(0.0, 2.0 * math.pi, 121)
CRANK_ROCKER = (
    """
name = "crank_rocker"
[units]
length = "mm"
[parameters]
ground_link = "42 mm"
crank_link = "15 mm"
coupler_link = "50 mm"
rocker_link = "45 mm"
height = "10 mm"
middle = "coupler_link / 2"
lean = "15 deg"
[bodies.ground]
points = { O = [0, 0], C = ["ground_link", 0] }
[bodies.crank]
points = { O = [0, 0], P = ["crank_link", 0] }
start = { phi = "60 deg" }
[bodies.coupler]
points = { P = [0, 0], Q = ["coupler_link", 0], tracer = ["middle * cos(lean)", "sqrt(height * height)"] }
start = { phi = "40 deg" }
[bodies.rocker]
points = { C = [0, 0], Q = ["rocker_link", 0] }
start = { phi = "100 deg" }
"""
    + FOURBAR_PINS
    + FOURBAR_DRIVER
    + """speed = "2 rad/s"
[measures.rest]
type = "dwell"
of = "rocker.phi"
band = "height / coupler_link"
[measures.part]
type = "maximum"
of = "coupler.y"
begin = "lean"
end = "lean + 100 deg"
"""
)
BEGIN, END = 1.0, 4.0
READ: tuple[Reading, ...] = (
    Minimum("minimum", "rocker.phi"),
    Maximum("maximum", DistanceBetween(("ground.O", "coupler.tracer"))),
    Range("range", "rocker.omega", BEGIN, END),
    Range("relative", AngleBetween("coupler", to="rocker")),
    PeakSpeed("peak_speed", "coupler.tracer"),
    PeakAcceleration("peak_acceleration", "rocker.phi"),
    TimeRatio("time_ratio", "rocker.phi"),
    Dwell("dwell", "rocker.phi", 0.1, "minimum"),
    Straightness("straightness", "coupler.tracer", BEGIN, END),
    Roundness("roundness", "coupler.tracer"),
    PathDistance("path_distance", "coupler.tracer", ((20.0, 30.0), (25.0, 40.0))),
    TransmissionAngle("transmission_angle", ("coupler.P", "coupler.Q"), ("rocker.C", "rocker.Q")),
    PressureAngle("pressure_angle", "crank", "coupler.tracer", "rocker.C"),
    VelocityRatio("velocity_ratio", "rocker.phi", None, "minimum", BEGIN, END),
    MechanicalAdvantage("mechanical_advantage", "coupler.phi", "rocker.phi", 2.0, 2.5),
    Peak("peak", "rocker.phi"),
    LowestMargin("lowest_margin"),
)
LENGTHS = ("ground_link", "crank_link", "coupler_link", "rocker_link")


def crank_rocker() -> kinfmu.Mechanism:
    return parse(CRANK_ROCKER)


def drawn(count: int, **others: object) -> dict[str, object]:
    rng = np.random.default_rng(3)
    lengths = {name: float(crank_rocker().parameters[name].value) for name in LENGTHS}
    values = {name: value * np.exp(rng.uniform(-0.03, 0.03, count)) for name, value in lengths.items()}
    return {**values, "height": rng.uniform(5.0, 20.0, count), "lean": rng.uniform(0.0, 0.4, count), **others}


def assert_as_measured(
    found: kinfmu.DesignMeasures, model: kinfmu.Model, measures: object, t: object = None, **inputs: np.ndarray
) -> None:
    """Check every design against `measure` of its run."""
    for k in range(len(found)):
        values = {name: float(array[k]) for name, array in found.parameters.items()}
        given = {name: array[k] if np.ndim(array) == 2 else array for name, array in inputs.items()}
        try:
            run = model.solve(t, parameters=values, **given)  # type: ignore[arg-type]
        except KinfmuError as error:
            reason = str(error)
        else:
            reason = ""
        if reason:
            assert found.reasons[k] == reason
            assert np.isnan([column[k] for column in found.values.values()]).all()
            continue
        assert found.status[k] == run.status.max()
        reasons = []
        for one in measures or [reading.name for reading in model.mechanism.measures]:  # type: ignore[attr-defined]
            name = one if isinstance(one, str) else one.name
            try:
                wanted = kinfmu.measure(run, [one])[name]
            except KinfmuError as error:
                reasons.append(str(error))
                assert np.isnan(found[name][k])
                continue
            assert found[name][k] == pytest.approx(wanted.value, rel=1e-12, abs=1e-13, nan_ok=True), name
            assert found.at[name][k] == pytest.approx(wanted.at, rel=1e-9, abs=2e-7, nan_ok=True), name
            assert (found.units[name], found.driver, found.at_unit) == (wanted.unit, wanted.driver, wanted.at_unit)
            reasons += [wanted.reason] if wanted.reason else []
        assert found.reasons.get(k) == (reasons[0] if reasons else None)


@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.few(1)
def test_every_kind_of_measure_equals_measure_of_each_design(engine: str) -> None:
    assert {reading.type for reading in READ} == {reading.type for reading in READINGS}
    model = kinfmu.compile(crank_rocker(), engine=engine)
    found = kinfmu.measure_designs(model, drawn(6), READ, crank_angle=TURN)  # type: ignore[arg-type]
    assert found.good.all()
    assert_as_measured(found, model, READ, crank_angle=TURN)


OF_EXTREMES: tuple[Reading, ...] = (
    Minimum("lowest", "coupler.y"),
    Maximum("fastest", "rocker.omega"),
    Range("across_the_end", "coupler.y", 5.5, 1.0),
    Range("relative", AngleBetween("coupler", to="rocker"), BEGIN, END),
    Peak("largest", "rocker.alpha"),
    PeakSpeed("speed", "coupler.tracer", BEGIN, END),
    PeakAcceleration("shock", "coupler.tracer"),
    PeakAcceleration("jerk", "rocker.phi", 5.5, 1.0),
    TimeRatio("quick_return", "rocker.phi"),
    TransmissionAngle("transmission", ("coupler.P", "coupler.Q"), ("rocker.C", "rocker.Q")),
)


@pytest.mark.parametrize(
    "angles",
    [TURN, TURN[::-1], np.linspace(0.0, 4.0 * math.pi, 241), np.linspace(0.5, 5.8, 100), TURN[:-1] + 0.01],
    ids=["turn", "backwards", "two turns", "open", "nearly a turn"],
)
@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.few(4)
def test_measures_of_extremes_are_read_without_tables(
    angles: np.ndarray, workers: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: object) -> None:
        raise AssertionError("all samples are kept")

    monkeypatch.setattr("kinfmu.motion.designs.BatchReading._samples_of", never)
    model = kinfmu.compile(crank_rocker(), engine="native")
    values = drawn(5)
    values["crank_link"] = np.array([15.0, np.nan, 38.0, 15.2, 14.9])  # one is invalid, one does not turn round
    twice = [one for one in OF_EXTREMES if isinstance(one, TimeRatio)]  # other extremes are at one of two equal places
    measures = OF_EXTREMES if np.ptp(angles) < 7.0 else twice
    found = kinfmu.measure_designs(model, values, measures, crank_angle=angles, workers=workers)  # type: ignore[arg-type]
    assert np.isfinite(next(iter(found.values.values()))[[0, 3, 4]]).all()
    assert_as_measured(found, model, measures, crank_angle=angles)


def test_measures_of_the_file_may_have_numbers_that_depend_on_the_design() -> None:
    model = kinfmu.compile(crank_rocker())
    found = kinfmu.measure_designs(model, drawn(4), crank_angle=TURN)  # type: ignore[arg-type]
    assert list(found.values) == ["rest", "part"]
    assert_as_measured(found, model, None, crank_angle=TURN)


@pytest.mark.parametrize("engine", ["python", "native"])
def test_designs_without_numbers_have_the_reasons_of_solve_and_measure(engine: str) -> None:
    model = kinfmu.compile(crank_rocker(), engine=engine)
    lengths = {"crank_link": [15.0, np.nan, 38.0, 15.2]}
    measures = [READ[0], TimeRatio("time_ratio", "rocker.phi"), Maximum("part", "rocker.phi", 1.0, 1.2)]
    found = kinfmu.measure_designs(model, lengths, measures, crank_angle=TURN)
    assert set(found.reasons) == {1, 2}
    assert "of 121 samples have no numbers, the first at crank = " in found.reasons[2]
    assert np.isfinite(found["part"][2])
    assert_as_measured(found, model, measures, crank_angle=TURN)


def test_what_one_design_refuses_is_its_reason() -> None:
    model = kinfmu.compile(crank_rocker())
    half = np.linspace(0.0, math.pi, 61)
    found = kinfmu.measure_designs(
        model, {"crank_link": [14.0, 15.0]}, [TimeRatio("time_ratio", "rocker.phi"), READ[0]], crank_angle=half
    )
    assert found.reasons[0].startswith("[measures.time_ratio]: time_ratio needs a motion that goes round")
    assert_as_measured(found, model, [TimeRatio("time_ratio", "rocker.phi"), READ[0]], crank_angle=half)


@pytest.mark.parametrize("constants", [{}, {"crank.speed": 3.0}, {"crank.speed": np.array([1.0, 2.0, 3.0])}])
def test_laws_over_time(constants: dict[str, object]) -> None:
    model = kinfmu.compile(crank_rocker())
    t = np.linspace(0.0, math.pi, 121)
    measures = [one for one in READ if one.name in ("minimum", "peak_speed", "dwell", "velocity_ratio")]
    found = kinfmu.measure_designs(model, drawn(3, **constants), measures, t)  # type: ignore[arg-type]
    assert found.units["peak_speed"] == "mm/s"
    assert_as_measured(found, model, measures, t)


def test_every_design_may_have_driver_values_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kinfmu.motion.designs.SAMPLES_AT_ONCE", len(TURN))  # a part for each
    model = kinfmu.compile(crank_rocker())
    angles = TURN + np.array([[0.0], [0.5], [1.0]])
    measures = [one for one in READ if one.name in ("minimum", "peak_speed", "dwell", "velocity_ratio")]
    found = kinfmu.measure_designs(model, drawn(3), measures, crank_angle=angles)  # type: ignore[arg-type]
    assert_as_measured(found, model, measures, crank_angle=angles)


def test_descending_driver_values_and_fixed_coordinates_that_depend_on_a_parameter() -> None:
    text = CRANK_ROCKER.replace('C = ["ground_link", 0] }', 'C = ["ground_link", 0], D = ["height", "middle"] }')
    body = "[bodies.post]\npoints = { D = [0, 0] }\nstart = { x = 10, y = 25 }\n"
    weld = 'D = { type = "fixed", between = ["ground.D", "post.D"] }\n'
    text = text.replace("[joints]\n", f"{body}[joints]\n{weld}")
    model = kinfmu.compile(parse(text))
    measures = [Range("r", DistanceBetween(("post.D", "coupler.tracer"))), Maximum("x", "post.x"), READ[0]]
    found = kinfmu.measure_designs(model, drawn(3), measures, crank_angle=TURN[::-1])  # type: ignore[arg-type]
    np.testing.assert_allclose(found["x"], found["height"], rtol=1e-15)
    assert_as_measured(found, model, measures, crank_angle=TURN[::-1])


@pytest.mark.long
def test_workers_and_the_size_of_parts_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    model = kinfmu.compile(crank_rocker(), engine="native")
    values = drawn(50)
    alone = kinfmu.measure_designs(model, values, READ[:-1], crank_angle=TURN)  # type: ignore[arg-type]
    for size, workers in ((121 * 7, 1), (121, 3)):
        monkeypatch.setattr("kinfmu.motion.designs.SAMPLES_AT_ONCE", size)
        other = kinfmu.measure_designs(model, values, READ[:-1], crank_angle=TURN, workers=workers)  # type: ignore[arg-type]
        for name in alone.values:
            np.testing.assert_array_equal(other[name], alone[name], name)
            np.testing.assert_array_equal(other.at[name], alone.at[name], name)


@pytest.mark.parametrize("name", ["jansen_leg", "cam_roller", "five_bar"])
@pytest.mark.few(1)
def test_mechanisms_of_the_gallery(name: str) -> None:
    """Coordinates, paths and distances as outputs of generated code, over the file's own laws."""
    mechanism = kinfmu.load(name)
    model = kinfmu.compile(mechanism, engine="native")
    first, *_, last = [point for point in mechanism.body_points if not point.startswith("ground.")]
    measures: list[Reading] = [Range(f"range_{k}", output) for k, output in enumerate(model.outputs[:6])]
    measures += [PeakSpeed("speed", last), PeakAcceleration("acceleration", model.outputs[-1])]
    measures += [Minimum("distance", DistanceBetween((first, last))), PathDistance("path", last, ((1.0, 2.0),))]
    names = list(mechanism.own_parameters)[:2]
    values = {name: float(mechanism.parameters[name].value) * np.array([1.0, 1.001, 0.999]) for name in names}
    t = mechanism.run.start + np.linspace(0.0, 1.0, 73)
    for chosen in (measures, measures[:-2]):  # the second without tables
        found = kinfmu.measure_designs(model, values, chosen, t)  # type: ignore[arg-type]
        assert found.good.all()
        assert_as_measured(found, model, chosen, t)


def test_compiled_and_python_arithmetic_are_equal_to_the_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(2)
    x = np.cumsum(rng.uniform(0.05, 0.2, 90))
    phase, speed = rng.uniform(0.0, 6.0, (40, 1)), rng.uniform(0.3, 25.0, (40, 1))
    value, rate = np.sin(speed * x + phase), speed * np.cos(speed * x + phase)
    value[3, 7] = np.nan
    value[4] = 1.0
    for is_closed in (True, False):
        found = []
        use_compiled()
        for library in (quintic._compiled, []):
            monkeypatch.setattr(quintic, "_compiled", library)
            history = History(x, value, rate, -speed * speed * np.sin(speed * x + phase), is_closed)
            histories = (history, history.derivative(), history.second_derivative(), history.negative())
            extremes = [e for one in histories for pair in (one.maximum(), one.minimum()) for e in pair]
            found.append([*(row for one in histories for row in one.rows), *extremes, *histories[2].largest_size()])
        for compiled, plain in zip(*found, strict=True):
            np.testing.assert_array_equal(compiled, plain)
        assert np.isnan(found[0][-1][3])


def test_the_result_is_a_table() -> None:
    model = kinfmu.compile(crank_rocker())
    found = kinfmu.measure_designs(model, {"crank_link": [14.0, 15.0], "height": 12.0}, [READ[2]], crank_angle=TURN)
    assert repr(found) == "<2 designs, 2 of them with all measures; range>"
    columns = {column.name: column for column in found.columns()}
    assert list(columns) == ["crank_link", "height", "range", "range.at", "range.at2", "solver.status"]
    assert [column.unit for column in columns.values()] == ["mm", "mm", "rad/rad", "rad", "rad", "1"]
    np.testing.assert_array_equal(columns["height"].values, [12.0, 12.0])
    frame = found.to_pandas()
    assert frame.attrs["units"]["range"] == "rad/rad"
    assert found.to_arrow().column_names == list(columns)
    with pytest.raises(KinfmuError, match="the designs have no column 'rnge'; did you mean 'range'"):
        found["rnge"]


@pytest.mark.parametrize(
    ("parameters", "measures", "arguments", "message"),
    [
        ({"crank": [1.0]}, [READ[0]], {"crank_angle": TURN}, "there is no parameter 'crank'"),
        ({"height": [1.0]}, ["swing"], {"crank_angle": TURN}, "there is no measure 'swing'; measures: rest, part"),
        ({"height": [1.0]}, [READ[0]], {"crank_angle": [0.0, 1.0]}, "there are 2 samples; measures need 3 or more"),
        ({"height": [1.0]}, [READ[0]], {"crank_angle": [0.0, 1.0, 1.0]}, "measures need values of crank_angle"),
        ({"height": [1.0]}, [READ[0]], {"t": [0.0, 1.0, 2.0], "crank_angle": TURN}, "give times or inputs, not both"),
        (
            {"height": [1.0]},
            [READ[0]],
            {"crank_angle": [1.0, 1.0, 1.0]},
            "measures need samples over time or over one dri",
        ),
        ({"height": [1.0]}, [], {"crank_angle": TURN}, "there are no measures: "),
        ({"crank.speed": [1.0]}, [READ[0]], {"crank_angle": TURN}, "crank.speed: the laws of drivers have no effect"),
        ({"height": [1.0]}, 5, {"crank_angle": TURN}, "measures = 5 must be a list of measures"),
        ({"height": [1.0]}, [READ[0]], {"crank_angle": TURN, "workers": 0}, "workers = 0 must be a positive whole"),
    ],
)
def test_a_wrong_request_is_refused_in_one_line(
    parameters: dict[str, object], measures: object, arguments: dict[str, object], message: str
) -> None:
    with pytest.raises(RequestError) as error:
        kinfmu.measure_designs(kinfmu.compile(crank_rocker()), parameters, measures, **arguments)  # type: ignore[arg-type]
    assert str(error.value).startswith(message)


def test_what_a_model_lacks_is_named_with_what_helps() -> None:
    with pytest.raises(RequestError, match=r"measure_designs needs a model, not Mechanism; kinfmu\.compile gives one"):
        kinfmu.measure_designs(crank_rocker(), {}, [READ[0]], crank_angle=TURN)  # type: ignore[arg-type]
    model = kinfmu.compile(crank_rocker(), ["rocker.phi"])
    with pytest.raises(
        RequestError, match=r"there is no output 'coupler.x', .*; solve or compile the mechanism with it"
    ):
        kinfmu.measure_designs(model, {"height": [1.0]}, [Range("far", of="coupler.x")], crank_angle=TURN)
    far = [Range("far", of="rocker.phi")]
    with pytest.raises(
        RequestError, match=r"^measures need values of crank_angle that ascend or descend; here some do not$"
    ):
        kinfmu.measure_designs(model, {"height": [1.0]}, far, crank_angle=[0.1, 0.3, 0.2])
    with pytest.raises(RequestError, match=r"here no driver moves$"):
        kinfmu.measure_designs(model, {"height": [1.0]}, [Range("far", of="rocker.phi")], crank_angle=[1.0, 1.0, 1.0])


@pytest.mark.parametrize("engine", ["python", "native"])
def test_margins_of_designs_need_no_mechanism_of_each_design(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    model = kinfmu.compile(crank_rocker(), engine=engine)
    lengths = np.linspace(14.0, 16.0, 4)
    margins = [LowestMargin("all"), LowestMargin("part", 5.5, 1.0)]  # the part crosses the end of the turn
    runs = [model.solve(crank_angle=TURN, parameters={"crank_link": length}) for length in lengths.tolist()]
    expected = [kinfmu.measure(run, margins) for run in runs]

    def never(*_: object) -> None:
        raise AssertionError("a mechanism is resolved, which takes milliseconds")

    monkeypatch.setattr(kinfmu.Mechanism, "with_parameters", never)
    found = kinfmu.measure_designs(model, {"crank_link": lengths}, margins, crank_angle=TURN)
    for name in ("all", "part"):
        assert found[name].tolist() == [one[name].value for one in expected]
        assert found.at[name][:, 0].tolist() == [one[name].at[0] for one in expected]


NO_VALUE = (
    (TimeRatio("m", "crank.phi"), "crank.phi turns all the way round, so it has no two strokes"),
    (TimeRatio("m", "rocker.x"), "rocker.x does not move"),
    (TimeRatio("m", "crank.omega"), "crank.omega does not move"),
    (Dwell("m", "crank.phi", 0.1), "crank.phi turns all the way round, so it has no maximum"),
    (Dwell("m", "crank.phi", 0.1, "minimum"), "crank.phi turns all the way round, so it has no minimum"),
    (VelocityRatio("m", "rocker.phi", "rocker.x"), "rocker.x does not move"),
    (MechanicalAdvantage("m", "rocker.x"), "rocker.x does not move"),
    (MechanicalAdvantage("m", "rocker.phi", "crank.y"), "crank.y does not move"),
)


@pytest.mark.parametrize(("reading", "reason"), NO_VALUE)
@pytest.mark.parametrize("engine", ["python", "native"])
@pytest.mark.few(3)
def test_what_has_no_value_of_an_angle_that_turns_on_or_of_a_constant_is_stated(
    engine: str, reading: Reading, reason: str
) -> None:
    model = kinfmu.compile(replace(crank_rocker(), coordinates="all"), engine=engine)
    found = kinfmu.measure_designs(model, {"crank_link": [14.0, 15.0]}, [reading], crank_angle=TURN)
    assert found.reasons == {0: reason, 1: reason}
    assert np.isnan(found["m"]).all()
    assert_as_measured(found, model, [reading], crank_angle=TURN)


@pytest.mark.parametrize("of", ["crank.phi", "rocker.x", "crank.omega"])
def test_every_kind_of_measure_of_a_turning_angle_and_of_a_constant_has_a_value_or_a_reason(of: str) -> None:
    model = kinfmu.compile(replace(crank_rocker(), coordinates="all"))
    kinds = [Minimum, Maximum, Range, Peak, PeakSpeed, PeakAcceleration, TimeRatio, VelocityRatio, MechanicalAdvantage]
    for reading in [Dwell("m", of, 0.1), *(kind("m", of) for kind in kinds)]:
        found = kinfmu.measure_designs(model, {"crank_link": [14.0, 15.0]}, [reading], crank_angle=TURN)
        assert np.isfinite(found["m"]).all() == (not found.reasons)
        assert_as_measured(found, model, [reading], crank_angle=TURN)


@pytest.mark.parametrize("engine", ["python", "native"])
def test_later_calls_for_the_same_measures_have_their_own_designs_and_samples(engine: str) -> None:
    model = kinfmu.compile(parse(CRANK_ROCKER, "crank_rocker"), engine=engine)
    swing, high = Range("swing", "rocker.phi"), Maximum("high", "coupler.y", begin=0.5, end=2.0)
    for lengths, stop, measures in [
        ([14.0, 15.0], 2.0, [swing, high]),
        ([16.0], 2.0, [swing, high]),
        ([16.0], 1.0, [swing, high]),
        ([16.0], 2.0, [swing, replace(high, begin=1.0)]),
        ([14.0, 15.0], 2.0, [swing, high]),
    ]:
        angles = np.linspace(0.0, stop * math.pi, 121)
        again = kinfmu.measure_designs(model, {"crank_link": lengths}, measures, crank_angle=angles)
        fresh = kinfmu.compile(model.mechanism, engine=engine)
        alone = kinfmu.measure_designs(fresh, {"crank_link": lengths}, measures, crank_angle=angles)
        for name in ("swing", "high"):
            assert np.array_equal(again[name], alone[name], equal_nan=True)
            assert np.array_equal(again.at[name], alone.at[name], equal_nan=True)
    kept = weakref.ref(model)
    del model, again
    gc.collect()
    assert kept() is None


def test_numbers_that_are_equal_but_invalid_are_refused_after_valid_ones() -> None:
    model = kinfmu.compile(parse(CRANK_ROCKER, "crank_rocker"))
    kinfmu.measure_designs(model, {}, [Maximum("high", "coupler.y", begin=1, end=2.0)], crank_angle=TURN)
    with pytest.raises(KinfmuError, match="begin = true must be a number"):
        kinfmu.measure_designs(model, {}, [Maximum("high", "coupler.y", begin=True, end=2.0)], crank_angle=TURN)
