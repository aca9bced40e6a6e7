"""A unit for a parameter that the file gives without one: studies and fits say where to write it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import kinfmu
from kinfmu.errors import KinfmuError
from kinfmu.mechanism.toml_file import parse
from tests.mechanism.test_wrong_files import CRANK_ROCKER

MECHANISM = parse(CRANK_ROCKER.replace("crank = 1.0", "size = 1.25", 1).replace('"crank", 0', '"0.8*size", 0', 1))
MEASURE = {"swing": {"type": "range", "of": "rocker.phi"}}


@pytest.mark.parametrize(
    "call",
    [
        lambda: kinfmu.study(MECHANISM, {"size": {"from": "25 mm", "to": "35 mm"}}, measures=MEASURE),
        lambda: kinfmu.study(MECHANISM, {"size": {"tolerance": "25 mm"}}, measures=MEASURE),
    ],
    ids=["range", "tolerance"],
)
def test_the_message_states_the_cure(call: Callable[[], Any]) -> None:
    with pytest.raises(KinfmuError) as caught:
        call()
    assert "'25 mm': unit 'mm' does not belong to a pure number; size has no unit in the mechanism file" in str(
        caught.value
    )
    assert str(caught.value).endswith('write there size = "1.25 m"')


def test_a_fit_states_the_cure_too(tmp_path: Any) -> None:
    from kinfmu.mechanism.toml_text import text

    swing = '[measures.swing]\ntype = "range"\nof = "rocker.phi"\n'
    (tmp_path / "mine.toml").write_text(f"{text(MECHANISM)}\n{swing}", encoding="utf-8")
    (tmp_path / "fit.toml").write_text(
        'mechanism = "mine.toml"\n[unknowns]\nsize = ["1000 mm", "1500 mm"]\n[targets.swing]\ntype = "measure"\n'
        'of = "swing"\nvalue = 1.0\n',
        encoding="utf-8",
    )
    with pytest.raises(KinfmuError, match=r'size = "1\.25 m"$'):
        kinfmu.fit(tmp_path / "fit.toml")
