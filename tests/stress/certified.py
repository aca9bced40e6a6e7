"""Certificates of random mechanisms against closed forms: `python -m tests.stress.certified`.

Poses that a certificate encloses must be those of the branch, to a turn: at thousands of places of a fine walk in long
doubles, and in 50 digits at random places of random cells (half of them among the narrowest, which are the hardest).
The range that it states must be that of the branch, and no driver value beyond the range may be certified.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, field

import numpy as np

from kinfmu.analysis.certified.certificate import Certificate
from kinfmu.analysis.certified.proving import certify
from kinfmu.analysis.driver_path import SIZES
from kinfmu.errors import KinfmuError
from tests.stress.branch import INSIDE, OUTSIDE, TURN, Expected, Floats, Interval
from tests.stress.comparisons import all_compared, command_line
from tests.stress.jets import DIGITS
from tests.stress.trial import trial

FAMILIES = ("four-bars", "slider-cranks", "pins in slots", "watt six-bars", "stephenson six-bars", "geared five-bars")
FAMILIES += ("led by laws",)  # cams with dwells
SAMPLES = 200  # of each mechanism, in 50 digits
LEAST_SHARE = 0.99  # of the range of a branch; mechanisms with less are listed
WALKED = 1e-9  # of the size: the same for places of the walk in long doubles, some of them 1e-13 from singular poses
ROUNDED = 1e-11  # of the size: lengths are given as doubles, which poses near singular ones amplify


@dataclass
class Certified:
    """What one certificate showed."""

    seed: int
    family: str
    share: float = 0.0
    seconds: float = 0.0
    checked: int = 0
    walked: int = 0
    refused: str = ""
    gaps: list[str] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)


def compared(task: tuple[int, str]) -> Certified:
    """Compare the certificate of a mechanism with closed forms."""
    seed, family = task
    drawn_trial = trial(seed, family)
    branch, drawn = drawn_trial.branch, drawn_trial.drawn
    found = Certified(seed, family)
    if not isinstance(branch, Interval):
        found.refused = "several drivers"
        return found
    begun = time.perf_counter()
    try:
        certificate = certify(drawn.mechanism)
    except KinfmuError as error:
        found.refused = str(error)
        return found
    found.seconds = time.perf_counter() - begun
    found.gaps = [gap.reason.partition(", along which")[0] for gap in certificate.gaps]
    _check_range(branch, certificate, found)
    found.share = _share(branch, certificate)
    _check_walk(branch, certificate, found)
    _check_poses(seed, branch, certificate, found)
    return found


def _share(branch: Interval, certificate: Certificate) -> float:
    """Return the part of the branch that is certified: up to its limits, else as far as both look."""
    cells = certificate.cover.cells
    low = branch.low if branch.low_is_limit else certificate.low
    high = branch.high if branch.high_is_limit else certificate.high
    if not branch.is_free:
        low, high = max(low, branch.low), min(high, branch.high)
    if branch.drawn.sketch.kinds == ("length",):
        start, reach = branch.drawn.start[0], SIZES * certificate.prover.formulas.plan.size
        low, high = max(low, start - reach), min(high, start + reach)
    inside = np.minimum(cells.high, high) - np.maximum(cells.low, low)
    return float(np.maximum(inside, 0.0).sum()) / (high - low)


def _judged(branch: Interval, u: Floats) -> tuple[Expected, Floats]:
    """Return what is right at driver values; without those beyond an end that is merely as far as was looked."""
    if not branch.is_free:
        u = u[(branch.low_is_limit | (u >= branch.low)) & (branch.high_is_limit | (u <= branch.high))]
    return branch.expected(u[:, None], np.ones(len(u), dtype=bool)), u


def _check_walk(branch: Interval, certificate: Certificate, found: Certified) -> None:
    u = np.unique(np.concatenate([branch.places, certificate.cover.cells.low, certificate.cover.cells.high]))
    expected, u = _judged(branch, u)
    exact = branch.drawn.positions(u[:, None]).columns
    scale = float(branch.drawn.frame.scale)
    for name in certificate.prover.formulas.plan.outputs:
        if name not in exact:
            continue
        is_angle = name.endswith(".phi")
        values = np.broadcast_to(np.asarray(exact[name].d0, dtype=float), u.shape)
        if is_angle:
            values = values + TURN * np.rint((expected.angles[name] - values) / TURN)
        slack = WALKED * np.maximum(1.0 if is_angle else scale, abs(values))
        low, high = certificate.enclosed(name, u)
        wrong = np.flatnonzero((expected.side == INSIDE) & ((values < low - slack) | (values > high + slack)))
        found.walked += int(np.isfinite(low).sum())
        found.faults += [f"{name} at {u[k]!r}: {values[k]!r}, not {low[k]!r} to {high[k]!r}" for k in wrong[:1]]


def _check_range(branch: Interval, certificate: Certificate, found: Certified) -> None:
    unit = 1.0 if branch.drawn.sketch.kinds == ("angle",) else float(branch.drawn.frame.scale)
    for centre in certificate.dead_centres:
        end, is_limit = (branch.high, branch.high_is_limit) if centre.is_high else (branch.low, branch.low_is_limit)
        is_beyond = centre.low > branch.high if centre.is_high else centre.high < branch.low
        if is_beyond and not is_limit:
            continue  # farther than was looked
        if not is_limit or not centre.low - 1e-9 * unit <= end <= centre.high + 1e-9 * unit:
            found.faults.append(f"dead centre {centre}, not {end!r}")


def _check_poses(seed: int, branch: Interval, certificate: Certificate, found: Certified) -> None:
    generator = np.random.default_rng(seed)
    cells = certificate.cover.cells
    if not len(cells):
        return
    width = cells.high - cells.low
    which = generator.integers(0, len(cells), SAMPLES)
    which[::2] = np.argsort(width)[which[::2] % min(len(cells), SAMPLES // 4)]
    u = cells.low[which] + generator.random(SAMPLES) * width[which]
    expected, u = _judged(branch, u)
    found.faults += [f"certified at {x!r}, where there is no pose" for x in u[expected.side == OUTSIDE]]
    inside = expected.side == INSIDE
    u, scale = u[inside], float(branch.drawn.frame.scale)
    if not len(u):
        return
    zero = np.zeros((len(u), 1))
    columns = branch.drawn.exactly(DIGITS, u[:, None], zero + 1.0, zero).columns
    found.checked = len(u)
    for name in certificate.prover.formulas.plan.outputs:
        if name not in columns:
            continue
        for order, exact in enumerate((columns[name].d0, columns[name].d1)):
            values = np.broadcast_to(np.asarray(exact, dtype=float), u.shape)
            if order == 0 and name.endswith(".phi"):
                values = values + TURN * np.rint((expected.angles[name][inside] - values) / TURN)
            low, high = certificate.enclosed(name, u, order)
            slack = (
                ROUNDED
                * np.maximum(1.0 if name.endswith(".phi") else scale, abs(values))
                * (1.0 if order == 0 else 1e4)
            )
            wrong = np.flatnonzero((values < low - slack) | (values > high + slack))
            found.faults += [
                f"{name} order {order} at {u[k]!r}: {values[k]!r}, not {low[k]!r} to {high[k]!r}" for k in wrong[:1]
            ]


def main() -> int:
    """Compare many mechanisms and print what is found; 1 if anything is wrong."""
    parser = command_line("Certificates of random mechanisms against closed forms.", 600)
    given = parser.parse_args()
    families = [given.family] if given.family else FAMILIES
    tasks = [(seed, families[seed % len(families)]) for seed in range(given.seed, given.seed + given.count)]
    found = all_compared(compared, tasks, given.jobs)
    for family in families:
        of = [one for one in found if one.family == family]
        done = [one for one in of if not one.refused]
        shares = np.array([one.share for one in done] or [0.0])
        poses, walked = sum(one.checked for one in of), sum(one.walked for one in of)
        whole = sum(not one.gaps for one in done)
        seconds = np.median([one.seconds for one in done] or [0.0])
        print(
            f"{family}: {len(done)} of {len(of)}, {poses} poses, {walked} walked, certified {shares.mean():.5f} "
            f"of the range, least {shares.min():.4f}, whole {whole}, median {seconds:.2f} s"
        )
        for reason in sorted({gap for one in done for gap in one.gaps}):
            print(f"    {sum(reason in one.gaps for one in done)} with: {reason}")
        for reason in sorted({one.refused.partition(":")[2][:60] for one in of if one.refused}):
            print(f"    refused: {reason}")
    for one in found:
        if not one.refused and one.share < LEAST_SHARE:
            print(f"seed {one.seed}, {one.family}: certified {one.share:.4f} of the range; {', '.join(one.gaps)}")
        for fault in one.faults[:2]:
            print(f"seed {one.seed}, {one.family}: {fault}")
    faulty = sum(bool(one.faults) for one in found)
    print(f"{len(found)} mechanisms, {faulty} wrong")
    return 1 if faulty else 0


if __name__ == "__main__":
    sys.exit(main())
