"""Runs to log: the reference four-bar in closed form, independent of the solver, and what can go wrong with a run."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np

from kinfmu.run import Event, Run
from kinfmu.solver.python.pose import Status

FOURBAR = Path(__file__).parents[2] / "fmus" / "fourbar" / "mechanism.toml"
DEGREE = np.pi / 180.0


def fourbar(t: np.ndarray) -> Run:
    """phi2 = 0, phi3 = phi1 = t deg, x2 = 1 + cos phi1, y2 = sin phi1; the far end A lies one further on in x."""
    t = np.asarray(t, dtype=float)
    phi, w, zero, one = DEGREE * t, DEGREE, np.zeros_like(t), np.ones_like(t)
    c, s = np.cos(phi), np.sin(phi)
    status = np.where(np.isclose(s, 0.0), Status.BRIDGED, Status.OK).astype(np.int64)
    return Run.of_texts(
        t=t,
        outputs=("crank.phi", "coupler.x", "coupler.y", "coupler.phi", "rocker.phi", "A.x", "A.y"),
        coordinate_count=5,
        values=np.column_stack([phi, 1 + c, s, zero, phi, 2 + c, s]),
        rates=np.column_stack([w * one, -s * w, c * w, zero, w * one, -s * w, c * w]),
        accelerations=np.column_stack([zero, -c * w**2, -s * w**2, zero, zero, -c * w**2, -s * w**2]),
        fixed={"crank.x": 0.0, "crank.y": 0.0, "rocker.x": 1.0, "rocker.y": 0.0},
        input_names=("crank_angle", "crank_speed", "crank_acceleration"),
        inputs=np.column_stack([phi, w * one, zero]),
        status=status,
        iterations=np.where(status == Status.OK, 2, 0).astype(np.int64),
        residual=np.abs(s) * 1.1e-16,
        margin=np.abs(s) / 2,
        error=np.where(status[:, None] == Status.BRIDGED, [[1e-14, 1e-13, 1e-12]], 0.0),
        watch_names=("AB",),
        watch=(np.abs(c) * 2.2e-16)[:, None],
        mechanism_source=FOURBAR.read_text(encoding="utf-8"),
        info={"name": "fourbar", "title": "Four-bar crank with a redundant constraint"},
    )


def with_gap(run: Run, first: int, last: int, status: Status = Status.OUTSIDE) -> Run:
    """The run with samples first to last out of reach: NaN, a status, and an event that says why."""
    rows = np.zeros(len(run), dtype=bool)
    rows[first : last + 1] = True
    blank = {name: np.where(rows[:, None], np.nan, getattr(run, name)) for name in ("values", "rates", "accelerations")}
    event = Event(float(run.t[first]), "error", "crank_angle = 1.9 rad: the limit is 1.75 rad")
    return dataclasses.replace(run, status=np.where(rows, status, run.status), events=(*run.events, event), **blank)


def without_samples(run: Run) -> Run:
    """The run before its first sample."""
    arrays = {field.name: getattr(run, field.name) for field in dataclasses.fields(run)}
    return dataclasses.replace(run, **{k: a[:0] for k, a in arrays.items() if isinstance(a, np.ndarray)})


def _watched(run: Run) -> Run:
    watch = np.random.default_rng(1).normal(scale=1e-16, size=(len(run), 40))
    return dataclasses.replace(run, watch_names=tuple(f"Bar {k}.length" for k in range(40)), watch=watch)


def _unicode(run: Run) -> Run:
    return dataclasses.replace(run, info={"name": "fourbar", "title": 'Kurbelgetriebe 四连杆 «é» "x"\n2'})


KINDS: dict[str, Callable[[], Run]] = {
    "plain": lambda: fourbar(np.arange(181.0)),
    "with a gap": lambda: with_gap(fourbar(np.arange(181.0)), 100, 120),
    "nothing but gap": lambda: with_gap(fourbar(np.arange(5.0)), 0, 4, Status.NOT_CONVERGED),
    "one sample": lambda: fourbar(np.array([60.0])),
    "before zero": lambda: fourbar(np.linspace(-1.5, 1.5, 31)),
    "unicode title": lambda: _unicode(fourbar(np.arange(3.0))),
    "many watches": lambda: _watched(fourbar(np.arange(0.0, 3.0, 0.001))),
    "no mechanism": lambda: dataclasses.replace(fourbar(np.arange(3.0)), mechanism_source="", info={}),
}
