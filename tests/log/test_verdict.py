"""The verdict on a run and its card."""

from __future__ import annotations

import dataclasses

import numpy as np

from kinfmu.log.viewer.card import card
from kinfmu.run import Event, Run
from kinfmu.run.verdict import notable_events, sentence
from kinfmu.solver.python.pose import Status
from tests.log.runs import fourbar, with_gap


def test_the_verdict_counts_samples_by_status(run_with_gap: Run) -> None:
    assert sentence(run_with_gap) == "181 samples: 158 ok, 2 bridged, 21 outside; worst residual 1.1e-16 at 90 s"


def test_events_are_in_order_of_time_with_their_levels(run_with_gap: Run) -> None:
    found = [(event.t, event.level) for event in notable_events(run_with_gap)]
    assert found == [(0, "info"), (1, "info"), (100, "error"), (121, "info"), (180, "info")]


def test_a_failure_is_reported_once_with_its_reason_and_without_its_time(run: Run) -> None:
    reason = "crank = 1.9 rad cannot be reached: the limit is 1.75 rad"
    failed = dataclasses.replace(with_gap(run, 100, 180), events=(Event(100.0, "error", f"at t = 100 s: {reason}"),))
    assert [event for event in notable_events(failed) if event.level == "error"] == [Event(100.0, "error", reason)]


def test_a_failure_that_no_event_explains_is_reported_by_its_status(run: Run) -> None:
    failed = dataclasses.replace(with_gap(run, 100, 120), events=(Event(99.0, "error", "something else"),))
    failures = [event.text for event in notable_events(failed) if event.level == "error"]
    assert failures == ["something else", "outside: the drivers cannot take the mechanism there"]


def test_a_run_whose_samples_are_all_ok_has_no_events() -> None:
    assert notable_events(fourbar(np.arange(10.0, 20.0))) == []


def test_near_singular_samples_are_a_warning(run: Run) -> None:
    near = dataclasses.replace(run, status=np.where(run.t == 5.0, Status.NEAR_SINGULAR, Status.OK))
    assert [(event.t, event.level) for event in notable_events(near)] == [(5.0, "warning"), (6.0, "info")]


def test_the_card_states_mechanism_run_verdict_and_events(run_with_gap: Run) -> None:
    text = card(run_with_gap, "Not drawn: coupler.")
    for part in (
        "### Four-bar crank with a redundant constraint",
        "181 samples, t = 0 to 180 s",
        "* 21 outside: ",
        "Worst residual 1.1e-16",
        "* **100 s:** crank\\_angle = 1.9 rad: the limit is 1.75 rad\n",
        "Watched, set aside as redundant: AB.",
        "Not drawn: coupler.",
    ):
        assert part in text


def test_text_from_outside_cannot_break_the_card(run: Run) -> None:
    odd = dataclasses.replace(run, info={"title": "a | b\n# <c>"}, events=(Event(1.0, "info", "x|y\nz"),))
    assert "### a \\| b \\# \\<c\\>\n" in card(odd)
    assert "* **1 s:** x\\|y z\n" in card(odd)


def test_the_card_lists_the_first_events_and_counts_the_others(run: Run) -> None:
    long = dataclasses.replace(run, events=tuple(Event(float(k), "info", f"event {k}") for k in range(100)))
    assert "* and 91 more, in the log\n" in card(long)
