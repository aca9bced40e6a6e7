"""What recordings state in words: the card of a run, and the parameters in which two runs differ."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from typing import NamedTuple

from kinfmu.errors import MechanismError
from kinfmu.log.viewer.series import Group
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.toml_file import parse
from kinfmu.run import Run
from kinfmu.run.axis import axis_of
from kinfmu.run.components import is_of_mechanisms, other_mechanisms
from kinfmu.run.verdict import MEANINGS, counts, notable_events, worst_residual
from kinfmu.units import Quantity, degrees_of, factors, unit_of

MOST_EVENTS = 12  # listed on the card; the log has all
_WORDS = {"generation_tool": "FMU made by", "parameters": "parameters set"}
_UNSHOWN = ("title", "token")  # only programs need the token; the record has it
_SETTINGS = "parameters"  # of the info of an FMU's run: what was set, 'crank = 22.0, crank_speed = 1.0'
_TEXTS = ("name", "title", "token", "engine", "generation_tool", _SETTINGS)  # of a run's info, which are no parameters
_NONE = "-"
_USUAL = {Quantity("angle"): "deg", Quantity("angle", 1): "rpm"}  # of people, where a record has rad and rad/s
_DIGITS = (6, 9, 12, 15, 17)
_ROUNDING = 1e-14  # relative; closer numbers are equal


def card(run: Run, note: str = "", groups: Iterable[Group] = ()) -> str:
    """Return the card as Markdown; note: one more sentence, such as what could not be drawn; groups: all curves."""
    axis = axis_of(run)
    title = run.info.get("title") or run.info.get("name") or "Run"
    lines = [f"### {plain(title)}", "", _period(run), ""]
    if note:
        lines += [plain(note), ""]
    worst = worst_residual(run)
    if worst:
        lines += [f"Worst residual {worst.residual:.2g} of the mechanism's size, at {axis.place(worst.t)}.", ""]
    lines += [f"* {number} {MEANINGS[status]}" for status, number in counts(run).items()]
    events = notable_events(run)
    if events:
        lines += ["", "What happened:", ""]
        lines += [f"* **{plain(axis.place(event.t))}:** {plain(event.text)}" for event in events[:MOST_EVENTS]]
        if len(events) > MOST_EVENTS:
            lines.append(f"* and {len(events) - MOST_EVENTS} more, in the log")
    if run.watch_names:
        lines += [
            "",
            f"Watched, set aside as redundant: {plain(', '.join(run.watch_names[:MOST_EVENTS]))}"
            + (f" and {len(run.watch_names) - MOST_EVENTS} more." if len(run.watch_names) > MOST_EVENTS else "."),
        ]
    about = {
        _WORDS.get(key, key): value
        for key, value in run.info.items()
        if key not in _UNSHOWN and value and not is_of_mechanisms(key)
    }
    lines += _table("about", about)
    constants = {}
    for name, value in run.fixed.items():
        unit, factor = degrees_of(unit_of(name.quantity(), run.length_unit))
        constants[str(name)] = f"{value * factor + 0.0:.6g} {unit}"
    for group in groups:
        constants |= {name: f"{value + 0.0:.6g} {group.unit}" for name, value in group.constants.items()}
    lines += _table("constant", constants)
    return "\n".join(lines) + "\n"


def _period(run: Run) -> str:
    if not len(run):
        return "No samples."
    axis = axis_of(run)
    units = f"Lengths in {run.length_unit}, angles in deg. {axis.rates}".strip() if run.outputs else ""
    if len(run) == 1:
        return f"One sample, at {axis.place(float(run.t[0]))}. {units}".rstrip()
    return f"{len(run)} samples, {axis.range()}. {units}".rstrip()


def _table(heading: str, entries: Mapping[str, str]) -> list[str]:
    if not entries:
        return []
    rows = [f"| {plain(name)} | {plain(value)} |" for name, value in entries.items()]
    return ["", f"| {heading} | |", "|---|---|", *rows]


def plain(text: str) -> str:
    """Return text escaped for Markdown, on one line."""
    return re.sub(r"([\\`*_|<>\[\]#])", r"\\\1", " ".join(text.split()))


class _Setting(NamedTuple):
    """A number with the units in which it is shown: shown number = number / factor."""

    value: float
    units: tuple[tuple[str, float], ...] = (("", 1.0),)

    def text(self, digits: int) -> str:
        first, *others = (f"{self.value / factor:.{digits}g} {unit}".rstrip() for unit, factor in self.units)
        return f"{first} ({others[0]})" if others else first


def parameters_apart(a: Run, b: Run) -> list[tuple[str, str, str]]:
    """Return the parameters and law constants that differ with their values in both runs, '-' where a run has none."""
    settings = [_settings(run) for run in (a, b)]
    rows = []
    for name in dict.fromkeys([*settings[0], *settings[1]]):
        one, other = (of_run.get(name, _NONE) for of_run in settings)
        if isinstance(one, _Setting) and isinstance(other, _Setting):
            if math.isclose(one.value, other.value, rel_tol=_ROUNDING):
                continue
            other = other._replace(units=one.units)
            digits = next((n for n in _DIGITS if one.text(n) != other.text(n)), _DIGITS[-1])
            rows.append((name, one.text(digits), other.text(digits)))
        elif one != other:
            texts = [value if isinstance(value, str) else value.text(_DIGITS[0]) for value in (one, other)]
            rows.append((name, texts[0], texts[1]))
    return rows


def _settings(run: Run) -> dict[str, _Setting | str]:
    """Return the parameters and law constants of a run, those of its mechanisms first, and what else was set."""
    found: dict[str, _Setting | str] = {}
    computed: set[str] = set()  # by expressions of other parameters
    for component, mechanism in _mechanisms(run):
        found |= {f"{component}{name}": setting for name, setting in _of_mechanism(mechanism)}
        computed |= {f"{component}{name}" for name in mechanism.parameters} - found.keys()
    for name, value in run.info.items():  # of a run of `solve`: the numbers with which it was computed
        if name not in (*_TEXTS, *computed) and not is_of_mechanisms(name):
            found[name] = _read(value, found.get(name))
    for name, value in _set_by_user(run.info).items():
        found.setdefault(name, _read(value, None))
    return found


def _mechanisms(run: Run) -> Iterator[tuple[str, Mechanism]]:
    """Yield the mechanisms of a run, each with what precedes the names of its columns."""
    with suppress(MechanismError):  # what a damaged record holds of the mechanism is not compared
        if run.mechanism is not None:
            yield "", run.mechanism
        for component, text in other_mechanisms(run.info).items():
            yield f"{component}.", parse(text, f"the mechanism of {component}")


def _of_mechanism(mechanism: Mechanism) -> Iterator[tuple[str, _Setting]]:
    """Yield what can be set of a mechanism, in the units of its file, angles of records in degrees and rpm too."""
    settable = mechanism.settable
    for name in (*mechanism.own_parameters, *settable.constants):
        setting = settable[name]
        unit, factor = settable.display_unit(name)
        units = [("" if unit == "1" else unit, factor)]
        usual = _USUAL.get(setting.quantity) if setting.quantity else None
        if setting.quantity and usual and factor == 1.0:
            units.append((usual, factors(setting.quantity, mechanism.length_unit)[usual]))
        yield name, _Setting(float(setting.value), tuple(units))


def _set_by_user(info: Mapping[str, str]) -> dict[str, str]:
    """Return what was set of an FMU, as text by name."""
    entries = (entry.partition(" = ") for entry in info.get(_SETTINGS, "").split(", "))
    return {name: value for name, equals, value in entries if equals}


def _read(text: str, known: _Setting | str | None) -> _Setting | str:
    """Return a number with the units of the setting known by its name; another text as it is."""
    try:
        value = float(text)
    except ValueError:
        return text
    return known._replace(value=value) if isinstance(known, _Setting) else _Setting(value)
