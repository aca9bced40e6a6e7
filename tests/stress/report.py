"""What many trials showed, counted and in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from tests.stress.branch import EDGE, OUTSIDE
from tests.stress.trial import NARROW, NEAR_LIMIT, ORDERS, ROUNDINGS, TIGHT, Verdict

STATUSES = ("ok", "near_singular", "bridged", "outside", "inconsistent", "not_converged")
EPS = float(np.finfo(float).eps)
SHOWN = 40  # faults


@dataclass
class Worst:
    """The largest error seen, and where."""

    error: float = -1.0
    seed: int = -1
    family: str = ""

    def take(self, error: float, verdict: Verdict) -> None:
        if error > self.error:
            self.error, self.seed, self.family = error, verdict.seed, verdict.family


@dataclass
class Report:
    """Counts over verdicts."""

    mechanisms: Counter[str] = field(default_factory=Counter)
    faulty: Counter[str] = field(default_factory=Counter)  # mechanisms
    samples: Counter[str] = field(default_factory=Counter)
    statuses: Counter[tuple[str, int]] = field(default_factory=Counter)
    worst: dict[tuple[int, int], Worst] = field(default_factory=dict)  # by status and order
    faults: dict[str, list[tuple[Verdict, str]]] = field(default_factory=dict)  # by kind, one a mechanism
    covered: list[list[int]] = field(default_factory=lambda: [[0, 0] for _ in ORDERS])
    ratios: list[list[np.ndarray]] = field(default_factory=lambda: [[] for _ in ORDERS])  # type: ignore[type-arg]
    digits: int = 0
    gap: float = 0.0
    edge: int = 0
    spared: int = 0
    narrow: int = 0
    blurred: int = 0
    refused: int = 0  # samples past a limit, reported as such

    def take(self, verdict: Verdict) -> None:
        """Count one more trial."""
        self.mechanisms[verdict.family] += 1
        self.samples[verdict.family] += len(verdict.statuses)
        for status, count in Counter(verdict.statuses.tolist()).items():
            self.statuses[verdict.family, status] += count
        self.digits += verdict.digits
        self.gap = max(self.gap, verdict.gap)
        self.spared += verdict.spared
        self.narrow += verdict.narrow
        self.blurred += verdict.blurred
        self.edge += int((verdict.side == EDGE).sum())
        self.refused += int(((verdict.side == OUTSIDE) & (verdict.statuses == 3)).sum())
        self.faulty[verdict.family] += bool(verdict.faults)
        for kind in dict.fromkeys(fault.kind for fault in verdict.faults):
            of_kind = [fault for fault in verdict.faults if fault.kind == kind]
            self.faults.setdefault(kind, []).append((verdict, f"sample {of_kind[0].sample}: {of_kind[0].text}"))
        known = ~np.isnan(verdict.relative[:, 0])
        for status in range(3):
            which = known & (verdict.statuses == status)
            if which.any():
                for order, error in enumerate(verdict.relative[which].max(axis=0)):
                    self.worst.setdefault((status, order), Worst()).take(float(error), verdict)
        for order in range(len(ORDERS)):
            error, estimate = verdict.absolute[known, order], verdict.estimate[known, order]
            self.covered[order][0] += int(((estimate >= error) | (verdict.relative[known, order] <= EPS)).sum())
            self.covered[order][1] += len(error)
            self.ratios[order].append((estimate / np.fmax(error, EPS)).astype(np.float32))

    @property
    def is_right(self) -> bool:
        return not self.faults

    def lines(self, command: str) -> list[str]:
        """The report; `command` is what one mechanism is tried by, but for its seed."""
        lines = [_row("family", "mechanisms", "at fault", "samples", *STATUSES)]
        for family in sorted(self.mechanisms):
            counts = [self.statuses[family, k] for k in range(len(STATUSES))]
            lines.append(_row(family, self.mechanisms[family], self.faulty[family], self.samples[family], *counts))
        totals = [sum(self.statuses[family, k] for family in self.mechanisms) for k in range(len(STATUSES))]
        lines.append(_row("all", self.mechanisms.total(), self.faulty.total(), self.samples.total(), *totals))
        lines.append("")
        lines.append("largest error of a column, of its largest magnitude, and what shows it alone:")
        for (status, order), worst in sorted(self.worst.items()):
            lines.append(
                f"  {STATUSES[status]:<14} {ORDERS[order]:<4} {worst.error:8.2g}   {command} --seed {worst.seed}"
            )
        lines.append("")
        lines.append(
            "error estimates: share of samples where it is at least the error (or that is a rounding); median of"
        )
        lines.append("estimate / error (or rounding), one in a hundred below, one in a hundred above:")
        for order, name in enumerate(ORDERS):
            hit, count = self.covered[order]
            low, middle, high = np.percentile(np.concatenate(self.ratios[order] or [np.ones(1)]), (1, 50, 99))
            lines.append(f"  {name:<4} {100.0 * hit / max(count, 1):8.3f} %   {middle:8.3g} {low:8.3g} {high:8.3g}")
        lines.append("")
        lines.append(
            f"{self.refused} samples past a limit were reported as such; {self.edge} were within 1e-10 of one; "
            f"reported as outside though the branch continues: {self.spared} behind a place tighter than {TIGHT:g}, "
            f"{self.narrow} behind a change point narrower than {NARROW:g} rad or within {NEAR_LIMIT:g} of a limit"
        )
        lines.append(
            f"{self.digits} samples were judged in 50 digits; the two oracles differed by {self.gap:.1g} of what "
            f"counts; {self.blurred} ok samples were off by more, as {ROUNDINGS:g} roundings of driver values are"
        )
        for kind, found in sorted(self.faults.items()):
            lines.append("")
            lines.append(f"{kind}: {len(found)} mechanisms")
            found = sorted(found, key=lambda one: one[0].seed)
            lines += [f"  {command} --seed {v.seed}   # {v.family}; {text}" for v, text in found[:SHOWN]]
            if len(found) > SHOWN:
                lines.append(f"  and {len(found) - SHOWN} more")
        return lines


def _row(first: str, *cells: object) -> str:
    return f"{first:<26}" + "".join(f"{cell:>15}" for cell in cells)


def details(verdict: Verdict, values: Sequence[Sequence[float]]) -> list[str]:
    """Sample by sample what a trial showed."""
    lines = [f"seed {verdict.seed}, {verdict.family}; {', '.join(verdict.patterns)}"]
    lines.append("sample  driver values  status  side  error of q, qd, qdd of magnitude | as estimated | estimate")
    faults: dict[int, list[str]] = {}
    for fault in verdict.faults:
        faults.setdefault(fault.sample, []).append(f"{fault.kind}: {fault.text}")
    lines += faults.pop(-1, [])
    for k, u in enumerate(values):
        numbers = " | ".join(
            " ".join(f"{value:8.1e}" for value in table[k])
            for table in (verdict.relative, verdict.absolute, verdict.estimate)
        )
        driven = " ".join(f"{value:.17g}" for value in u)
        side = ("inside", "outside", "edge", "?")[verdict.side[k]]
        lines.append(f"{k:4d}  {driven}  {verdict.statuses[k]}  {side}  {numbers}  {'; '.join(faults.get(k, []))}")
    return lines
