"""The text card of a recording: mechanism, run, verdict."""

from __future__ import annotations

import re
from collections.abc import Mapping

from kinfmu.run import Run
from kinfmu.run.axis import axis_of
from kinfmu.run.components import is_of_mechanisms
from kinfmu.run.verdict import MEANINGS, counts, notable_events, worst_residual

MOST_EVENTS = 12  # listed on the card; the log has all
_WORDS = {"generation_tool": "FMU made by", "parameters": "parameters set"}
_UNSHOWN = ("title", "token")  # only programs need the token; the record has it


def card(run: Run, note: str = "") -> str:
    """Return the card as Markdown; note: one more sentence, such as what could not be drawn."""
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
    lines += _table("constant", {name: f"{value:g}" for name, value in run.fixed.items()})
    return "\n".join(lines) + "\n"


def _period(run: Run) -> str:
    if not len(run):
        return "No samples."
    axis = axis_of(run)
    units = f"Lengths in {run.length_unit}, angles in rad. {axis.rates}".strip() if run.outputs else ""
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
