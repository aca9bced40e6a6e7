"""Compare a host's results, or those of fmpy, with the reference results in an FMU."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from shlex import quote
from typing import NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.errors import FmuError, RequestError, listed, suggestion
from kinfmu.fmu import description, reference
from kinfmu.fmu.host.simulate import simulate
from kinfmu.fmu.reference import FOLDER, ReferenceResults
from kinfmu.fmu.unpacked import DESCRIPTION, LARGEST_DESCRIPTION, text_in, unpacked
from kinfmu.mechanism.valid import quoted
from kinfmu.units import Quantity, every_unit, spelled

_SAME_TIME = 1e-6  # of a step: hosts sum up time
_UNIT = re.compile(r"\s*\[([^]]*)\]\s*$")
_LARGEST_TABLE = 2**28  # [bytes] of a host's results
_FEWEST_DIGITS = 3  # results of fewer digits show nothing


@dataclass(frozen=True)
class Verification:
    """How far results are from the reference results in an FMU.

    Attributes:
        tolerance: Largest valid difference, relative to the size of the numbers with the same unit.
        samples: Number of reference samples.
        missing: Times [s] of reference samples that the results do not have.
        names: Outputs that were compared.
        left_out: Outputs to compare that the results do not have.
        name: Output with the largest relative difference.
        time: Its time [s].
        value: The result there.
        wanted: The reference result there.
        difference: The difference, relative.
        is_a_step_late: True if the row after each sample equals the reference of that sample, within the tolerance.
        ends: Times [s] of the first and the last row of a host's table; None for an FMU that kinfmu steps itself.
        rounding: Tolerance for the digits of the numbers in a host's table; 0 for fewer than three digits, and for an
            FMU that kinfmu steps itself.
        unit_notes: Notes on outputs that differ throughout by the factor between two units.

    """

    tolerance: float
    samples: int
    missing: tuple[float, ...]
    names: tuple[str, ...]
    left_out: tuple[str, ...]
    name: str
    time: float
    value: float
    wanted: float
    difference: float
    is_a_step_late: bool
    ends: tuple[float, float] | None = None
    rounding: float = 0.0
    unit_notes: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """True if all outputs are there within the tolerance, and no sample is missing, except as in is_shorter."""
        return not self.left_out and (not self.missing or self.is_shorter) and self.difference <= self.tolerance

    @property
    def is_shorter(self) -> bool:
        """True if a host's table begins late or ends early, and has all samples between, which are half of all.

        Many hosts write no row before the first step. The last step may be missing, since hosts sum up steps, and the
        sum passes the stop time by rounding.
        """
        if self.ends is None or not self.missing:
            return False
        first, last = self.ends
        return all(not first <= t <= last for t in self.missing) and 2 * len(self.missing) <= self.samples

    def __str__(self) -> str:
        """Return the result in a few lines."""
        compared = f"{len(self.names)} outputs at {self.samples - len(self.missing)} of {self.samples} samples"
        largest = (
            f"largest difference {self.difference:.2g} (relative), limit {self.tolerance:.2g}: "
            f"{self.name} at t = {self.time:g} s is {self.value:.10g}, reference {self.wanted:.10g}"
        )
        lines = [f"{compared} compared", largest]
        if self.left_out:
            lines.append(f"not in the results: {listed(self.left_out)}")
        if self.missing:
            rows = "" if self.ends is None else f"; the rows are from {self.ends[0]:.10g} s to {self.ends[1]:.10g} s"
            lines.append(f"no results at t = {listed(f'{t:g}' for t in self.missing)} [s]{rows}")
        if self.is_shorter and self.ok:
            there = self.samples - len(self.missing)
            lines.append(f"the results agree at the {there} of {self.samples} samples that they have")
        if self.is_a_step_late:
            lines.append("the row after each sample equals its reference: this host records outputs a step late")
        elif self.tolerance < self.difference <= self.rounding:
            text = "the digits of the results may be the difference: compare with --tolerance"
            lines.append(f"{text} {self.rounding:g}")
        return "\n".join([*lines, *self.unit_notes])


def verify(
    fmu: str | Path,
    results: str | Path | None = None,
    *,
    tolerance: float | None = None,
    columns: Sequence[str] | None = None,
) -> Verification:
    """Compare results with the reference results in an FMU of kinfmu.

    Args:
        fmu: File of the FMU.
        results: CSV file of a host, with a column time and outputs by name, alone, or behind the name of an instance as
            in fourbar::coupler.x and model.fourbar.coupler.x; with units as in "coupler.phi [deg]". Rows at other times
            than those of the reference are left out. Default: the FMU is stepped with fmpy.
        tolerance: Largest valid difference, relative to the largest number with the same unit. Default: that in the
            FMU, which is 1e-9 but near singular points. A host that writes six digits needs 1e-5.
        columns: Outputs to compare, such as 'crank.phi' or 'ram.*', with * for any letters. Default: all.

    Returns:
        The verification. It is not `ok` if the results do not have an output to compare.

    Raises:
        FmuError: The FMU has no reference results, or is not of kinfmu; the results are damaged, have no output, or
            have one twice.
        RequestError: The tolerance is not valid, or a column is no output.

    """
    path = Path(fmu)
    if tolerance is not None and not 0.0 < tolerance < 1.0:
        raise RequestError(f"tolerance = {tolerance:g} must be above 0 and below 1")
    with unpacked(path) as folder:
        about = description.read(text_in(path, folder, DESCRIPTION, LARGEST_DESCRIPTION).encode(), str(path))
        name = about.interface.name
        has_results = (folder / FOLDER / f"{name}_ref.csv").exists()
        if not has_results and about.interface.part("states"):
            raise FmuError(
                f"{path}: efforts drive this FMU, and its results depend on them and on the steps of the host, so that "
                f"it holds no reference results; compare with kinfmu simulate {quote(str(path))}"
            )
        if not has_results:
            raise FmuError(f"{path}: holds no reference results ({FOLDER}/{name}_ref.csv); build it again")
        files = [file.name for file in (folder / FOLDER).iterdir() if file.name.startswith(f"{name}_")]
        texts = {file: text_in(path, folder, f"{FOLDER}/{file}") for file in files}
    try:
        wanted = reference.read(name, texts)
    except ValueError as error:
        raise FmuError(f"{path}: the reference results in {FOLDER} are damaged: {error}") from None
    units = {variable.name: variable.unit or "1" for variable in about.interface}
    unknown = [one for one in wanted.names if one not in units]
    if unknown:
        raise FmuError(f"{path}: the reference results in {FOLDER} are damaged: {quoted(unknown[0])} is no variable")
    length_unit = about.interface.length_unit
    wanted = _chosen(wanted, columns)
    if results is None:
        values = _stepped(path, wanted)
        table = _Table(wanted.names, values, np.vstack([values[1:], np.full((1, values.shape[1]), np.nan)]))
    else:
        table = _table_of_host(Path(results), wanted, units, length_unit)
    return _compared(wanted, units, table, wanted.tolerance if tolerance is None else tolerance, length_unit)


def _chosen(wanted: ReferenceResults, columns: Sequence[str] | None) -> ReferenceResults:
    """Return the reference results of some outputs, by names with * for any letters; None: all."""
    if columns is None:
        return wanted
    for one in columns:
        if not any(fnmatchcase(name, one) for name in wanted.names):
            raise RequestError(
                f"columns: the reference results have no output {quoted(one)}{suggestion(one, wanted.names)}; outputs: "
                f"{listed(wanted.names)}, with * for any letters"
            )
    kept = [any(fnmatchcase(name, one) for one in columns) for name in wanted.names]
    names = tuple(name for name, is_kept in zip(wanted.names, kept, strict=True) if is_kept)
    return wanted._replace(names=names, values=wanted.values[:, kept])


class _Table(NamedTuple):
    """Results to compare.

    names: outputs (k,); values: (n, k) at the samples of the reference; after: (n, k) one row later; both NaN where
    there are none; ends: first and last time, and rounding: as in Verification, both of a file.
    """

    names: tuple[str, ...]
    values: FloatArray
    after: FloatArray
    ends: tuple[float, float] | None = None
    rounding: float = 0.0


def _stepped(path: Path, wanted: ReferenceResults) -> FloatArray:
    """Return the outputs (n, k) of the FMU, stepped through fmpy's low-level calls."""
    t, step = wanted.t, wanted.step
    inputs = None
    if wanted.input_names:
        inputs = {"time": t} | dict(zip(wanted.input_names, wanted.inputs.T, strict=True))
    parameters = None if inputs else {"driven_by_time": True}
    run = simulate(path, start=float(t[0]), stop=float(t[-1]), step=step, inputs=inputs, parameters=parameters)
    rows = np.full((len(t), len(wanted.names)), np.nan)
    count = int(run.good.sum())
    rows[:count] = np.column_stack([run[name][:count] for name in wanted.names])
    return rows


def _table_of_host(path: Path, wanted: ReferenceResults, units: dict[str, str], length_unit: str) -> _Table:
    """Return the results in a file."""
    try:
        if path.stat().st_size > _LARGEST_TABLE:
            raise FmuError(f"{path}: is too large (largest: {_LARGEST_TABLE} bytes)")
        text = path.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise FmuError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error})") from None
    lines = text.splitlines()
    delimiter = max(",;\t", key=lines[0].count) if lines else ","
    header, *rows = [row for row in csv.reader(io.StringIO(text), delimiter=delimiter) if row] or [[]]
    titles = [_UNIT.sub("", one.strip()) for one in header]
    times = [k for k, one in enumerate(titles) if one.lower() == "time"]
    if not times:
        raise FmuError(f"{path}: has no column time; columns: {listed(titles)}")
    places = {name: k for name in wanted.names if (k := _place(path, name, titles, header)) is not None}
    if not places:
        raise FmuError(f"{path}: has no output of the FMU, such as {listed(wanted.names[:3])}")
    columns = [times[0], *places.values()]
    table = np.array([[_number(path, k, row, header, place) for place in columns] for k, row in enumerate(rows, 1)])
    table = table.reshape(-1, len(columns))
    if len(wrong := np.flatnonzero(~np.isfinite(table[:, 0]))):
        raise FmuError(f"{path}: row {wrong[0] + 1} after the header has the time {table[wrong[0], 0]}")
    for column, (name, place) in enumerate(places.items(), start=1):
        table[:, column] *= _factor(path, header[place], units[name], length_unit)
    found, after = np.full((2, len(wanted.t), len(places)), np.nan)
    times_of_host, same = table[:, 0], _SAME_TIME * wanted.step
    for k, time in enumerate(wanted.t.tolist()):
        near = np.flatnonzero(np.abs(times_of_host - time) <= same)
        if len(near):
            found[k] = table[near[-1], 1:]  # of rows at one time the last is after events
            later = times_of_host[times_of_host > time + same]
            if len(later):
                after[k] = table[np.flatnonzero(np.abs(times_of_host - later.min()) <= same)[-1], 1:]
    ends = (float(table[:, 0].min()), float(table[:, 0].max())) if len(table) else None
    digits = max((_digits(row[k]) for row in rows for k in columns[1:]), default=0)
    return _Table(tuple(places), found, after, ends, 10.0 ** (1 - digits) if digits >= _FEWEST_DIGITS else 0.0)


def _place(path: Path, name: str, titles: list[str], header: list[str]) -> int | None:
    """Return the place of an output among the titles of columns, by its name alone or behind that of an instance."""
    found = [k for k, title in enumerate(titles) if title == name]
    found = found or [k for k, title in enumerate(titles) if title.endswith((f"::{name}", f".{name}"))]
    if len(found) > 1:
        columns = " and ".join(f"{k + 1}, {quoted(header[k].strip())}" for k in found[:2])
        raise FmuError(f"{path}: output {name} is in columns {columns}; leave only one of them in the table")
    return found[0] if found else None


def _digits(text: str) -> int:
    """Return the number of digits of a number, without zeros before the first one."""
    return len(text.lower().partition("e")[0].strip(" +-").replace(".", "").lstrip("0"))


def _number(path: Path, number: int, row: list[str], header: list[str], place: int) -> float:
    """Return the number in a column of a row, whose own number is for messages."""
    where = f"{path}: is no table of numbers: row {number} after the header"
    if place >= len(row):
        raise FmuError(f"{where} has {len(row)} values, the header {len(header)}")
    try:
        return float(row[place])
    except ValueError:
        text = f"{where}, column {quoted(header[place].strip())}: {quoted(row[place])}"
        raise FmuError(f"{text}; valid are numbers with a decimal point, such as 1234.5") from None


def _factor(path: Path, title: str, unit: str, length_unit: str) -> float:
    """Return the factor from the unit in the title of a column, if there is one, to that of the variable."""
    found = _UNIT.search(title)
    stated, known = spelled(found[1]) if found else unit, every_unit(length_unit)
    if stated == unit or stated not in known or unit not in known:
        return 1.0  # hosts also write types in brackets
    if known[stated][0] != known[unit][0]:
        raise FmuError(f"{path}: column {quoted(title)}: unit '{stated}' does not fit '{unit}'")
    return known[stated][1] / known[unit][1]


def _compared(
    wanted: ReferenceResults, units: dict[str, str], table: _Table, tolerance: float, length_unit: str
) -> Verification:
    names, found = table.names, table.values
    values = wanted.values[:, [wanted.names.index(name) for name in names]]
    sizes = _sizes(wanted, units)
    scale = np.array([sizes[units[name]] or 1.0 for name in names])
    is_missing = np.asarray(np.isnan(found).all(axis=1))
    relative = np.abs(found - values) / scale
    relative[np.isnan(relative) & ~is_missing[:, None]] = np.inf
    relative[is_missing] = -1.0
    row, column = (int(one) for one in np.unravel_index(int(np.argmax(relative)), relative.shape))
    difference = float(relative[row, column])
    late = (np.abs(table.after - values) / scale)[~np.isnan(table.after).all(axis=1)]
    rows = ~is_missing
    notes = _unit_notes(
        {
            name: (units[name], found[rows, k] / scale[k], values[rows, k] / scale[k])
            for k, name in enumerate(names)
            if relative[:, k].max() > tolerance
        },
        every_unit(length_unit),
        max(tolerance, table.rounding),
    )
    return Verification(
        tolerance=tolerance,
        samples=len(wanted.t),
        missing=tuple(wanted.t[is_missing].tolist()),
        names=names,
        left_out=tuple(name for name in wanted.names if name not in names),
        name=names[column],
        time=float(wanted.t[row]),
        value=float(found[row, column]),
        wanted=float(values[row, column]),
        difference=difference if difference >= 0.0 else float("nan"),
        is_a_step_late=difference > tolerance and len(late) > 0 and bool((late <= tolerance).all()),
        ends=table.ends,
        rounding=table.rounding,
        unit_notes=tuple(notes),
    )


def _unit_notes(
    differing: dict[str, tuple[str, FloatArray, FloatArray]], known: dict[str, tuple[Quantity, float]], limit: float
) -> Iterator[str]:
    """Yield a note for each other unit in which outputs that differ would agree.

    differing: unit, results and reference results by output, both relative to the size of the numbers with this unit;
    known: quantity and factor of all units; limit: largest valid difference.
    """
    grouped: dict[str, list[str]] = {}
    for name, (unit, found, values) in differing.items():
        quantity, factor = known.get(unit, (None, 1.0))
        for other, (kind, other_factor) in known.items():
            ratio = factor / other_factor
            if kind == quantity and ratio != 1.0 and (np.abs(found / ratio - values) <= limit).all():
                grouped.setdefault(f"{other} in place of {unit}, {ratio:.6g} times the reference", []).append(name)
                break
    for pair, names in grouped.items():
        yield f"units? {listed(names)}: {pair} throughout"


def _sizes(wanted: ReferenceResults, units: dict[str, str]) -> dict[str, float]:
    """Return the largest numbers by unit; rates count at least as their values over the time of the reference.

    A mechanism at constant speed has accelerations of 0, which co-simulation estimates with rounding errors.
    """
    largest: dict[str, float] = {}
    for name, size in zip(wanted.names, np.abs(wanted.values).max(axis=0).tolist(), strict=True):
        largest[units[name]] = max(largest.get(units[name], 0.0), size)
    span = float(wanted.t[-1] - wanted.t[0])
    found = dict(largest)
    for unit in largest:
        base, _, per = unit.partition("/")
        if per in ("s", "s2") and base in largest:
            found[unit] = max(found[unit], largest[base] / span ** (1 if per == "s" else 2))
    return found
