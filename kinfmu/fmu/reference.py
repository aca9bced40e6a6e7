"""Reference results in an FMU: a few samples of its outputs, by which a receiver checks a host.

    extra/org.kinfmu/<name>_ref.csv     time and outputs
    extra/org.kinfmu/<name>_ref.opt     start, stop and step [s], and the relative tolerance
    extra/org.kinfmu/<name>_in.csv      time and inputs, of FMUs that inputs drive

The names and contents of the files are those of the FMI Cross-Check.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import KinfmuError
from kinfmu.fmu.interface import Interface
from kinfmu.mechanism.laws import External
from kinfmu.run import Run
from kinfmu.run.axis import TIME

if TYPE_CHECKING:
    from kinfmu.plan import SolvePlan

FOLDER = "extra/org.kinfmu"  # FMI: subfolders of extra/ are named by reversed domains
STEPS = 20
_FINER = 6  # steps of the run for each of them: its picture has smooth paths
_MOST_NUMBERS = 20_000  # in the table; large mechanisms have fewer samples
_PARTS = ("values", "rates", "accelerations", "forces", "reactions", "shaking")
_TOLERANCE = 1e-9  # relative; the two engines and all hosts agree within 1e-12 at regular poses
_MARGIN = 100.0  # of the tolerance to estimated errors: at singular points engines differ by as much as these
_SWING = {"angle": 0.1, "length": 0.02}  # [rad], of the size: motion of drivers whose law is external
_HALVINGS = 6  # of that motion, near a limit


class ReferenceResults(NamedTuple):
    """Reference results: times (n,) [s], outputs (n, k), inputs (n, i), their names, and the relative tolerance."""

    t: FloatArray
    names: tuple[str, ...]
    values: FloatArray
    input_names: tuple[str, ...]
    inputs: FloatArray
    tolerance: float

    @property
    def step(self) -> float:
        return float(self.t[-1] - self.t[0]) / (len(self.t) - 1)


def reference_run(plan: SolvePlan) -> Run | None:
    """Return the run from which picture and reference results are made; None if it cannot be solved.

    The motion is that of the laws over the default experiment. Drivers whose law is external swing about their start.
    """
    span = plan.mechanism.run
    stop = span.stop if span.stop > span.start else span.start + STEPS * span.step
    t = np.linspace(span.start, stop, STEPS * _FINER + 1)
    try:
        run = _run(plan, t)
    except KinfmuError:
        return None
    return run.replaced(t=t, axis=TIME)


def reference(run: Run, variables: Interface) -> ReferenceResults | None:
    """Return the reference results of an FMU; None if the first two samples have no solution.

    They are at most 21 of the samples of a run by `reference_run`, as far as these can be reached.
    """
    names = tuple(variable.name for part in _PARTS for variable in variables.part(part))
    steps = next(n for n in (STEPS, STEPS // 2, STEPS // 4) if n * len(names) <= _MOST_NUMBERS or n == STEPS // 4)
    run = run.part(slice(None, None, len(run) // steps))
    t = run.t
    count = len(t) if run.good.all() else int(np.argmin(run.good))
    if count < 2:
        return None
    table = np.column_stack([run[name][:count] for name in names]) if names else np.empty((count, 0))
    is_known = np.asarray(np.isfinite(table).all(axis=0))  # reactions are unknown at bridged samples
    is_driven_by_time = bool(variables.part("drive")[0].start)
    worst = 0.0
    if run.status[:count].any():  # not all regular
        error = run.error[:count]
        worst = float(np.max(error[np.isfinite(error)], initial=0.0))
    return ReferenceResults(
        t[:count],
        tuple(name for name, known in zip(names, is_known.tolist(), strict=True) if known),
        table[:, is_known],
        () if is_driven_by_time else tuple(run.input_names),
        np.empty((count, 0)) if is_driven_by_time else np.asarray(run.inputs)[:count],
        max(_TOLERANCE, 10.0 ** math.ceil(math.log10(_MARGIN * worst)) if worst else 0.0),
    )


def _run(plan: SolvePlan, t: FloatArray) -> Run:
    """Return the run over times t (n,) [s], in which drivers whose law is external swing."""
    from kinfmu.run.model import Model

    model = Model(plan, "python")
    run = model.solve(t)  # external laws give their start
    if not any(isinstance(driver.law, External) for driver in plan.mechanism.drivers):
        return run
    still = np.array(run.inputs)
    for halvings in range(_HALVINGS):
        run = model.solve(**_swung(plan, t, still, 0.5**halvings))
        if run.good.all():
            break
    return run


def _swung(plan: SolvePlan, t: FloatArray, still: FloatArray, share: float) -> dict[str, Any]:
    """Return the inputs of all drivers: `still` (n, 3 d), and a swing about the start for external laws."""
    inputs: dict[str, Any] = dict(zip((name for one in plan.drivers for name in one.inputs), still.T, strict=True))
    rate = 2.0 * math.pi / float(t[-1] - t[0])
    sine, cosine = np.sin(rate * (t - t[0])), np.cos(rate * (t - t[0]))
    for driver, one in zip(plan.mechanism.drivers, plan.drivers, strict=True):
        if isinstance(driver.law, External):
            value, speed, acceleration = one.inputs
            swing = share * _SWING[driver.quantity.kind] * (plan.size if driver.quantity.kind == "length" else 1.0)
            inputs[value] = inputs[value] + swing * sine
            inputs |= {speed: swing * rate * cosine, acceleration: -swing * rate * rate * sine}
    return inputs


def files(name: str, found: ReferenceResults | None) -> dict[str, bytes]:
    """Return the files of the reference results by path in the FMU; none without results."""
    if found is None:
        return {}
    options = {"StartTime": found.t[0], "StopTime": found.t[-1], "StepSize": found.step, "RelTol": found.tolerance}
    contents = {
        f"{FOLDER}/{name}_ref.csv": _csv(found.t, found.names, found.values),
        f"{FOLDER}/{name}_ref.opt": "".join(f"{key}, {float(value)!r}\n" for key, value in options.items()),
    }
    if found.input_names:
        contents[f"{FOLDER}/{name}_in.csv"] = _csv(found.t, found.input_names, found.inputs)
    return {path: text.encode() for path, text in contents.items()}


def read(name: str, texts: Mapping[str, str]) -> ReferenceResults:
    """Return reference results from the texts of their files, by the names of the files; inverse of `files`.

    Raises:
        ValueError: A file is missing or damaged.

    """
    try:
        t, names, values = _table(texts[f"{name}_ref.csv"])
        options = dict(line.split(",") for line in texts[f"{name}_ref.opt"].splitlines() if line.strip())
        tolerance = float(options["RelTol"])
    except KeyError as error:
        raise ValueError(f"{error.args[0]} is missing") from None
    input_names: tuple[str, ...] = ()
    inputs = np.empty((len(t), 0))
    if f"{name}_in.csv" in texts:
        _, input_names, inputs = _table(texts[f"{name}_in.csv"])
    if len(t) < 2 or not (np.diff(t) > 0.0).all():
        raise ValueError(f"{name}_ref.csv needs two or more samples at increasing times")
    return ReferenceResults(t, names, values, input_names, inputs, tolerance)


def _csv(t: FloatArray, names: Sequence[str], values: FloatArray) -> str:
    """Return a table as text. Fourteen digits are less than engines differ by, so the text is the same everywhere."""
    rows = [
        ",".join([repr(time), *(f"{value + 0.0:.14g}" for value in row)])
        for time, row in zip(t.tolist(), values.tolist(), strict=True)
    ]
    return "\n".join([",".join(["time", *names]), *rows, ""])


def _table(text: str) -> tuple[FloatArray, tuple[str, ...], FloatArray]:
    header, *rows = (line.split(",") for line in text.splitlines() if line.strip())
    table = np.array(rows, float).reshape(-1, len(header))
    return table[:, 0], tuple(header[1:]), table[:, 1:]
