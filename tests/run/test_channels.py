"""Which columns and samples are kept: names, groups, patterns; what is left out is not computed."""

from __future__ import annotations

import dataclasses
import re
from typing import NoReturn

import numpy as np
import pytest

from kinfmu.errors import KinfmuError, RequestError
from kinfmu.run import Run
from kinfmu.run.channels import absent_columns, coordinates, is_drawn, kept_samples, select
from tests.log.runs import fourbar


def run(n: int = 5) -> Run:
    return fourbar(np.arange(float(n)))


def kept(*names: str) -> list[str]:
    return [column.name for column in select(run(), names).columns()]


def never() -> NoReturn:
    raise AssertionError("this was not to be computed")


def test_groups_are_the_columns_that_they_say() -> None:
    assert kept("none") == ["time", "solver.status"]
    assert kept("inputs") == ["time", "crank_angle", "crank_speed", "crank_acceleration", "solver.status"]
    q = ["crank.phi", "coupler.x", "coupler.y", "coupler.phi", "rocker.phi"]
    assert kept("q") == ["time", *q, "solver.status"]
    assert kept("qd")[1:6] == ["crank.omega", "coupler.vx", "coupler.vy", "coupler.omega", "rocker.omega"]
    assert kept("qdd")[1:6] == ["crank.alpha", "coupler.ax", "coupler.ay", "coupler.alpha", "rocker.alpha"]
    assert kept("points")[1:-1] == ["A.x", "A.y", "A.vx", "A.vy", "A.ax", "A.ay"]
    assert kept("error")[2:] == ["solver.error_q", "solver.error_qd", "solver.error_qdd"]
    assert kept("residual", "iterations", "margin", "watch")[2:] == [
        "solver.residual",
        "solver.iterations",
        "solver.margin",
        "watch.AB",
    ]


def test_all_means_every_column_as_does_no_choice() -> None:
    everything = [column.name for column in run().columns()]
    assert kept("all") == everything == [column.name for column in select(run()).columns()]


def test_columns_are_chosen_by_name_and_by_pattern_and_left_out_by_a_minus() -> None:
    assert kept("coupler.vx", "rocker.*") == [
        "time", "rocker.phi", "coupler.vx", "rocker.omega", "rocker.alpha", "solver.status",
    ]  # fmt: skip
    everything = kept("all")
    assert kept("-error", "-A.?") == [name for name in everything if "error" not in name and name not in ("A.x", "A.y")]
    assert kept("q", "-coupler.*") == ["time", "crank.phi", "rocker.phi", "solver.status"]


def test_what_is_drawn_is_chosen_like_a_channel() -> None:
    assert [is_drawn(names) for names in (None, ["all"], ["-error"], ["q", "drawn"])] == [True] * 4
    assert [is_drawn(names) for names in (["none"], ["q"], ["-drawn"], ["all", "-drawn"])] == [False] * 4


def test_an_unknown_channel_is_reported_with_similar_names() -> None:
    with pytest.raises(
        KinfmuError, match=r"^channel 'margins' is not known; did you mean 'margin'\?; channels: all, none"
    ):
        absent_columns(run(), ["margins"])
    with pytest.raises(KinfmuError, match=r"did you mean 'coupler\.vx'\?; .*, or columns such as 'crank\.phi', with"):
        absent_columns(run(), ["coupler.vxx"])


def test_coordinates_are_chosen_as_columns_are_in_the_order_named() -> None:
    run = fourbar(np.arange(3.0))
    assert coordinates(run, ["rocker.phi", "coupler.*", "coupler.x"]) == (
        "rocker.phi",
        "coupler.x",
        "coupler.y",
        "coupler.phi",
    )
    assert coordinates(run, ["q"]) == coordinates(run, ["qdd"]) == run.names
    assert coordinates(run, ["all"]) == coordinates(run, ["-error"]) == coordinates(run, ["-qd"]) == run.outputs
    assert coordinates(run, ["points", "-A.*"]) == tuple(n for n in run.outputs[run.coordinate_count :] if n[0] != "A")
    assert coordinates(run, ["coupler.v?"]) == ("coupler.x", "coupler.y")
    assert coordinates(run, ["rocker.x", "crank.vy"]) == ("rocker.x", "crank.y")  # fixed ones
    assert coordinates(select(run, ["q"]), ["A.x"]) == ("A.x",)


def test_the_message_of_an_unknown_coordinate_lists_those_there_are() -> None:
    run = fourbar(np.arange(3.0))
    known = "; coordinates: crank.phi, coupler.x, .*, or q, points, all, with [*] for any letters$"
    for name in ("solver.residual", "error", "none", "ram.*", "time"):
        with pytest.raises(RequestError, match=rf"^the run has no coordinate '{re.escape(name)}'{known}"):
            coordinates(run, ["coupler.x", name])
    with pytest.raises(RequestError, match=r"no coordinate 'cupler\.vx'; did you mean 'coupler\.vx'\?; coord"):
        coordinates(run, ["cupler.vx"])
    with pytest.raises(RequestError, match=r"channel 'cupler\.x' is not known"):
        coordinates(run, ["q", "-cupler.x"])


def test_what_is_left_out_is_not_computed() -> None:
    late = dataclasses.replace(run(), margin=never, error=never)
    part = select(late, ["-error", "-margin"], rate=0.5)
    assert part.t.tolist() == [0.0, 2.0, 4.0]
    assert np.isnan(part.margin).all()
    assert part.error.shape == (3, 3)
    assert np.isnan(part.error).all()


def test_a_column_left_out_is_reported_and_one_kept_is_as_it_was() -> None:
    whole = run()
    part = select(whole, ["-coupler.x", "-iterations"])
    with pytest.raises(
        KinfmuError, match=r"^the run does not hold 'coupler\.x': it was not among the channels to keep$"
    ):
        part["coupler.x"]
    np.testing.assert_array_equal(part["coupler.y"], whole["coupler.y"])
    assert np.isnan(part.values[:, 1]).all()
    assert not part.iterations.any()
    assert whole.absent == frozenset()
    assert np.isfinite(whole.values).all()


def test_the_rate_keeps_the_first_sample_of_each_period_and_the_last() -> None:
    t = 0.1 * np.arange(26)
    assert kept_samples(t, None).tolist() == list(range(26))
    assert kept_samples(t, 2.0).tolist() == [0, 5, 10, 15, 20, 25]
    assert kept_samples(t, 4.0).tolist() == [0, 3, 5, 8, 10, 13, 15, 18, 20, 23, 25]
    assert kept_samples(t, 1000.0).tolist() == list(range(26))
    assert kept_samples(t, 1e-9).tolist() == [0, 25]
    assert kept_samples(t[:0], 1.0).tolist() == []
    for rate in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(KinfmuError, match="samples a second must be positive and finite"):
            kept_samples(t, rate)
