"""Coordinates that are not outputs of a run are recomputed on the branch of the run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kinfmu
from kinfmu.draw.scene.placing import recomputed
from kinfmu.errors import KinfmuError
from kinfmu.run.continued import continued
from tests.test_parameters_by_every_way import LENGTHS, TIMES, drawn, linkage, side


def test_a_run_with_parameters_set_is_completed_on_its_own_branch(tmp_path: Path) -> None:
    start = {"coupler": (0.5, 0.8, 2.0), "rocker": (4, 0, -0.4)}
    bodies = tuple(replace(body, start=start.get(body.name, body.start)) for body in linkage().bodies)
    mechanism = replace(linkage(), bodies=bodies, coordinates=("rocker.phi",))
    whole = replace(mechanism, coordinates="all")
    lengths = next(values for values in drawn(8, seed=22) if _differs(whole, values))
    set_ = {name: lengths[name] for name in LENGTHS}
    fmu = kinfmu.build(mechanism, tmp_path / "short.fmu", flavour="python")
    run = kinfmu.simulate(fmu, parameters=set_)
    columns = recomputed(run, mechanism)
    assert columns is not None
    followed = kinfmu.solve(continued(whole, set_).mechanism, run.t)
    for name in ("coupler.x", "coupler.phi", "rocker.phi"):
        assert columns[name] == pytest.approx(followed[name], abs=1e-11)


def _differs(mechanism: kinfmu.Mechanism, values: dict[str, float]) -> bool:
    """Whether the lengths assemble on another branch than the one that is followed to them."""
    lengths = {name: values[name] for name in LENGTHS}
    try:
        by_file = kinfmu.solve(mechanism.with_parameters(lengths), TIMES[:1])
        followed = continued(mechanism, lengths)
        run = kinfmu.solve(followed.mechanism, TIMES[:1])
    except KinfmuError:
        return False
    return not followed.message and bool(np.all(run.good)) and side(run) != side(by_file)
