"""Timing in turn: every way once a round."""

from __future__ import annotations

import gc
from collections.abc import Callable

from benchmarks.rounds import in_turn, samples_in_turn, spread


def test_all_ways_take_their_turn_in_every_round_after_one_that_warms_up() -> None:
    called: list[str] = []
    ways: list[Callable[[], object]] = [lambda: called.append("a"), lambda: called.append("b")]
    in_turn(ways, 3, each=lambda: called.append("|"))
    assert "".join(called) == "ab" + "ab|" * 3


def test_times_are_those_of_the_clock() -> None:
    now = iter([0.0, 1.0, 10.0, 13.0, 20.0, 20.5, 30.0, 32.0])
    assert in_turn([int, int], 2, clock=lambda: next(now)) == [[1.0, 0.5], [3.0, 2.0]]


def test_a_way_is_asked_for_no_more_samples_than_there_are_and_again_until_a_slice_is_filled() -> None:
    asked: list[int] = []
    (times,) = samples_in_turn([asked.append], 4, most=17)
    first, second, *slices = asked
    assert (first, second) == (1, 5)
    assert set(slices) == {17}
    assert len(slices) % 5 == 0  # one round warms up
    assert len(slices) > 5
    assert len(times) == 4
    assert min(times) >= 0.0


def test_what_lives_before_is_set_aside_while_measuring_and_given_back() -> None:
    frozen: list[int] = []
    in_turn([lambda: frozen.append(gc.get_freeze_count())], 1)
    assert min(frozen) > 0
    assert gc.get_freeze_count() == 0


def test_the_spread_has_median_range_and_quartiles() -> None:
    assert spread([3.0, 1.0, 2.0, 5.0, 4.0]) == (3.0, 1.0, 5.0, 1.5, 4.5)
    assert spread([2.0]) == (2.0, 2.0, 2.0, 2.0, 2.0)
