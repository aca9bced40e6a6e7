"""The key tables of docs/mechanism-files.md and docs/measures-reference.md, from the declared keys of the classes."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from typing import Any

from kinfmu.mechanism.declared import REQUIRED, Key, keys_of, summary_of
from kinfmu.mechanism.drivers import DRIVERS
from kinfmu.mechanism.joints import JOINTS
from kinfmu.mechanism.laws import LAWS, LawQuantity
from kinfmu.mechanism.loads import LOADS
from kinfmu.mechanism.measures import READINGS
from kinfmu.mechanism.quantities import POSE_QUANTITIES
from kinfmu.units import ANGLES, KINDS, METRES, OTHER_SPELLINGS, SECONDS, Quantity

SHAPES = {
    "truth": "`true` or `false`",
    "numbers": "list of numbers",
    "points": "list of `[x, u]`",
    "segments": "list of tables",
    "measure": "a measured quantity",
    "measured": "a coordinate, a rate or a quantity",
    "law": "law",
}
VECTOR = "d = r_j + A_j s_b - r_i - A_i s_a"  # once on the page, as RISE
RISE = "u = start + rise N(s),   s = (x - begin) / duration"
SHARED = 4  # types with the same key, from which it is in one table for all of them
CLEAR = (
    "the two points",
    "the two points 'body.point'",
    "the point",
    "the point 'body.point'",
    "the body",
)  # from the value
REFERRED = {
    "point": ('`"body.point"`', 'two `"body.point"`'),
    "body": ("a body", "two bodies"),
    "coordinate": ("a coordinate", "two coordinates"),
}


def sections() -> dict[str, str]:
    """Return the generated parts of the page by name, as Markdown."""
    groups = {"joints": JOINTS, "drivers": DRIVERS, "loads": LOADS, "measures": POSE_QUANTITIES, "laws": LAWS}
    return {"units": _units()} | {name: _types(classes) for name, classes in groups.items()}


def filled(page: str) -> str:
    """Return the page with its generated parts replaced."""
    return _with(page, sections())


def with_readings(page: str) -> str:
    """Return the page of types of measures with its generated part replaced."""
    text = _types(READINGS)
    words = {"as u": "as the quantity", "as x": "as the driver", "list of `[x, u]`": "list of `[x, y]`"}
    for general, here in words.items():
        text = text.replace(general, here)
    return _with(page, {"readings": text})


def _with(page: str, texts: dict[str, str]) -> str:
    for name, text in texts.items():
        begin, end = f"<!-- generated: {name} -->", f"<!-- end: {name} -->"
        assert page.count(begin) == page.count(end) == 1, f"the page must have {begin} and {end}, once"
        page = re.sub(f"{begin}.*?{end}", lambda _, part=f"{begin}\n\n{text}\n\n{end}": part, page, flags=re.DOTALL)
    return page


def _units() -> str:
    rows = {"length": METRES, "angle": ANGLES, "time": SECONDS}
    lines = ["| what | units |", "|---|---|"]
    lines += [f"| {kind} | {_listed(_with_other_spellings(units))} |" for kind, units in rows.items()]
    lines += [
        "| speed | such as `mm/s`, `m/min` |",
        "| angular speed | such as `rad/s`, `deg/s`, `rev/min`; `rpm`; `Hz` (periods or turns per second) |",
        "| acceleration | such as `mm/s2`, `deg/s2`; also higher derivatives such as `mm/s3` |",
        *(f"| {kind} | {_listed(KINDS[kind].units)} |" for kind in ("mass", "inertia", "force", "torque")),
        *(f"| {kind} | {_listed(KINDS[kind].units)} |" for kind in ("stiffness", "damping")),
        "| torsional stiffness | a torque per `rad` or `deg`, such as `N m/rad`, `N mm/deg` |",
        "| torsional damping | such as `N m s/rad`, `N m s/deg` |",
        "| per angle or length | for cams and couplings, such as `mm/rad`, `mm/deg2`, `rad/mm` |",
        "| number | none |",
    ]
    return "\n".join(lines)


def _with_other_spellings(units: Iterable[str]) -> Iterable[str]:
    """Yield units, each followed by its other spelling."""
    others = {unit: other for other, unit in OTHER_SPELLINGS.items()}
    for unit in units:
        yield from (unit, others[unit]) if unit in others else (unit,)


def _listed(units: Iterable[str]) -> str:
    return ", ".join(f"`{unit}`" for unit in units)


def _types(classes: Iterable[Any]) -> str:
    """Return a section a type, after a table of the keys that several types share."""
    classes = list(classes)
    counts = Counter(key for cls in classes for key in keys_of(cls))
    shared = [key for key, count in counts.items() if count >= SHARED]
    blocks = []
    if shared:
        lines = ["| key of several types | value | default | meaning |", "|---|---|---|---|"]
        lines += [f"| `{key.name}` | {_value(key)} | {_default(key)} | {_cell(key.meaning)} |" for key in shared]
        blocks.append("\n".join(lines))
    for cls in classes:
        keys = keys_of(cls)
        common = ", ".join(f"`{key.name}`" for key in keys if key in shared)
        summary = f"{summary_of(cls)}.{f' Keys: {common}.' if common else ''}"
        equation = [f"    {line}" for line in _equation(cls)]
        lines = [_item(key) for key in keys if key not in shared]
        if cls.type == "spline":
            lines.append("* `file` (name of a CSV file): two columns, instead of `points`")
        blocks += [f"### `{cls.type}`", summary, *(["\n".join(equation)] if equation else [])]
        blocks += ["\n".join(lines)] if lines else []
    return "\n\n".join(blocks)


def _item(key: Key) -> str:
    """Return the line of a key: what it takes, its default, its meaning."""
    default = _default(key)
    end = f", {default}" if default == "required" else f", default {default}" if default else ", optional"
    facts = _value(key) + (end if default or "default:" not in key.meaning else "")
    is_clear = key.meaning in CLEAR or (key.refers and key.refers.kind == "choice" and " or " in key.meaning[:20])
    meaning = "" if is_clear else f": {key.meaning}"
    return f"* `{key.name}` ({facts}){meaning}"


def _equation(cls: Any) -> list[str]:
    """Return the indented lines of the docstring, or of that of a base class."""
    for base in cls.__mro__:
        lines = [line.strip() for line in (base.__doc__ or "").splitlines() if line.startswith(" " * 8)]
        if lines:
            lines = [line.replace(f",   {VECTOR}", "") for line in lines if line != RISE]
            return [re.sub(r"\s{2,}", "    ", line) for line in lines]
    return []


def _value(key: Key) -> str:
    if key.takes == "number":
        return _measured(key.measures)
    if key.takes in SHAPES:
        return SHAPES[key.takes]
    assert key.refers is not None
    if key.refers.kind == "choice":
        return " or ".join(f'`"{choice}"`' for choice in key.refers.choices)
    return REFERRED[key.refers.kind][key.takes == "pair"]


def _measured(measures: Quantity | LawQuantity | None) -> str:
    if isinstance(measures, LawQuantity):
        base = {"led": "as u", "argument": "as x"}.get(measures.of, measures.of)
        return base + (" per x" if measures.order else "")
    assert measures is not None
    return measures.kind.replace("_", " ")


def _default(key: Key) -> str:
    if key.default is REQUIRED:
        return "required"
    if key.default is None:
        return ""
    if isinstance(key.default, bool):
        return f"`{str(key.default).lower()}`"
    return f'`"{key.default}"`' if isinstance(key.default, str) else f"{key.default:g}"


def _cell(text: str) -> str:
    return text.replace("|", r"\|")
