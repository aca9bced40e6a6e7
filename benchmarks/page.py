"""The measurements as Markdown, and their places in a page."""

from __future__ import annotations

import csv
import math
import platform
import re
from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path

from benchmarks.accuracy import Measured
from benchmarks.engine import PREDICTORS, EngineSetting
from benchmarks.engines import ENGINES
from benchmarks.singular import Near
from kinfmu.errors import KinfmuError
from kinfmu.mechanism import gallery

PAGE, SETTINGS = "accuracy.md", "accuracy-settings.csv"
SETTINGS_COLUMNS = (
    *("mechanism", "engine", "usual", "predictor", "newton", "stops_at"),
    *("us_a_sample", "lower_quartile", "upper_quartile", "q", "qd", "qdd"),
)
PARTS = ("conditions", "engines", "singular points")


def begin(name: str) -> str:
    """Return the comment before a generated part of a page."""
    return f"<!-- generated: {name} -->"


def end(name: str) -> str:
    """Return the comment after a generated part of a page."""
    return f"<!-- end: {name} -->"


def check(folder: Path) -> None:
    """Raise a KinfmuError if PAGE is in a folder without a place for each generated part."""
    page = folder / PAGE
    if page.exists():
        filled(page.read_text(encoding="utf-8"), dict.fromkeys(PARTS, ""), page)


def write(folder: Path, parts: Mapping[str, str], settings: str) -> tuple[Path, ...]:
    """Fill the generated parts of PAGE in a folder, or make a page of them alone; also write SETTINGS."""
    page, other = folder / PAGE, folder / SETTINGS
    text = page.read_text(encoding="utf-8") if page.exists() else _bare()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        page.write_text(filled(text, parts, page), encoding="utf-8", newline="\n")
        other.write_text(settings, encoding="utf-8", newline="\n")
    except OSError as error:
        raise KinfmuError(f"{error.filename}: cannot be written ({error.strerror})") from None
    return page, other


def filled(page: str, parts: Mapping[str, str], path: Path) -> str:
    """Return the page with its generated parts replaced; raise a KinfmuError if a place for one is missing."""
    for name, text in parts.items():
        if page.count(begin(name)) != 1 or page.count(end(name)) != 1:
            raise KinfmuError(f"{path}: must have {begin(name)} and {end(name)}, once each")
        before, _, rest = page.partition(begin(name))
        page = f"{before}{begin(name)}\n\n{text}\n\n{end(name)}{rest.partition(end(name))[2]}"
    return page


def _bare() -> str:
    places = "\n\n".join(f"{begin(name)}\n{end(name)}" for name in PARTS)
    return f"# Accuracy\n\n{places}\n"


def conditions(rounds: int) -> str:
    """Return a sentence on the machine and method of the times."""
    where = f"{_processor()}, Python {platform.python_version()}"
    return f"Measured on {where}; processor time, median of {rounds} rounds, each of which measures every engine once."


def _processor() -> str:
    """Return the name of the processor."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        text = ""
    names = re.findall(r"^model name\s*: (.+)$", text, re.MULTILINE)
    return names[0] if names else platform.processor() or platform.machine()


def parts(measured: Sequence[Measured], near: Sequence[Near], rounds: int) -> dict[str, str]:
    """Return the generated parts of PAGE by name."""
    return dict(zip(PARTS, (conditions(rounds), engines_table(measured), singular_table(near)), strict=True))


def engines_table(measured: Sequence[Measured]) -> str:
    """Return a table of every engine in its usual setting, one column a mechanism: time and error."""
    cases = list(dict.fromkeys(one.case for one in measured))
    lines = [f"| | {' | '.join(_titled(case) for case in cases)} |", f"|---|{'---|' * len(cases)}"]
    usual = {(one.engine, one.case): one for one in measured if one.is_usual}
    for engine in ENGINES:
        cells = [_cell(usual.get((engine.name, case))) for case in cases]
        if any(cells):
            lines.append(f"| {engine.name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _cell(one: Measured | None) -> str:
    return f"{duration(one.microseconds.median)} us, {number(one.error)}" if one else ""


def _titled(case: str) -> str:
    return f"[`{case}`](../fmus/{case}/README.md)" if case in gallery.names() else case


def settings_table(measured: Sequence[Measured]) -> str:
    """Return every measurement as CSV."""
    text = StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(SETTINGS_COLUMNS)
    for one in measured:
        of = one.microseconds
        table.writerow(
            (
                *row_head(one.case, one.engine, one.setting, is_usual=one.is_usual),
                *map(duration, (of.median, of.lower, of.upper)),
                *map(number, one.errors),
            )
        )
    return text.getvalue()


def row_head(case: str, engine: str, setting: EngineSetting, *, is_usual: bool) -> tuple[str, ...]:
    """Return the cells that state what was measured."""
    first = (case, engine, "yes" if is_usual else "")
    if engine == "pylinkage":
        return (*first, "", "closed forms", "")
    return (*first, PREDICTORS[setting.predictor], "chord" if setting.chord else "full", setting.stop)


def singular_table(near: Sequence[Near]) -> str:
    """Return a table of the errors of q, qd, qdd at each singular point, one line an engine."""
    points = list(dict.fromkeys(one.point for one in near))
    errors = {(one.engine, one.point): ", ".join(number(float(error)) for error in one.at) for one in near}
    lines = [f"| | {' | '.join(points)} |", f"|---|{'---|' * len(points)}"]
    engines = dict.fromkeys(one.engine for one in near)
    lines += [f"| {engine} | {' | '.join(errors.get((engine, point), '') for point in points)} |" for engine in engines]
    return "\n".join(lines)


def duration(microseconds: float) -> str:
    """Return three digits: '4.52', '45.2', '1610'."""
    return f"{microseconds:.3g}" if microseconds < 1000.0 else f"{microseconds:.0f}"


def number(error: float) -> str:
    """Return '1e-15', '0', or a dash where there was no number."""
    if math.isnan(error):
        return "-"
    return "0" if error == 0.0 else f"{error:.0e}"
