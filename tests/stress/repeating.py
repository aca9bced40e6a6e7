"""Long runs of random repeating laws against 50 digits: `python -m tests.stress.repeating`.

A sequence of rises and dwells drives the crank of a slider-crank, up to a million periods from its begin. The law is
evaluated in fractions, whole periods are taken off without rounding. The mechanism is compared with its closed form at
the driver values of the run, since an angle of a million radians has 10 digits after the point.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Literal

import numpy as np

import kinfmu
from kinfmu import AngleDriver, Body, Mechanism, MotionSequence, Revolute, Segment, Translational
from tests.power_series import mp
from tests.stress.comparisons import all_compared, command_line
from tests.stress.families import Draw

ROUNDINGS = 4.0  # of the largest values, and of the time in a period: the largest error of the law
STEEPEST = (2.2, 7.6, 60.0)  # first, second and third derivative of a rise by its part
EPS = 2.0**-52
BEYOND = 10.0  # times its estimate: the largest error of the mechanism
SAMPLES = 60
SHAPES = {  # of rises: coefficients of the powers of a part, the lowest first
    "dwell": (0,),
    "3-4-5": (0, 0, 0, 10, -15, 6),
    "4-5-6-7": (0, 0, 0, 0, 35, -84, 70, -20),
}


@dataclass
class Repeated:
    """What a run of one law showed: largest errors of the slider and its rates, of the largest in the run."""

    seed: int
    family: str
    errors: tuple[float, ...]
    faults: list[str] = field(default_factory=list)


@dataclass
class Driven:
    """A slider-crank with a repeating law, and the times of its samples."""

    law: MotionSequence
    crank: float
    rod: float
    times: np.ndarray

    @property
    def mechanism(self) -> Mechanism:
        start = self.law.start
        return Mechanism(
            "repeating",
            [
                Body("ground", {"O": (0.0, 0.0)}),
                Body("crank", {"O": (0.0, 0.0), "P": (self.crank, 0.0)}, (0.0, 0.0, start)),
                Body("rod", {"P": (0.0, 0.0), "S": (self.rod, 0.0)}),
                Body("slider", {"S": (0.0, 0.0)}, (self.crank + self.rod, 0.0, 0.0)),
            ],
            [
                Revolute("O", ("ground.O", "crank.O")),
                Revolute("P", ("crank.P", "rod.P")),
                Revolute("S", ("rod.S", "slider.S")),
                Translational("guide", ("ground.O", "slider.S")),
            ],
            [AngleDriver("crank", "crank", self.law)],
        )

    def crank_at(self, time: float) -> list[Fraction]:
        """Angle, speed and acceleration of the crank, without rounding."""
        period = sum((Fraction(one.duration) for one in self.law.segments), Fraction(0))
        since = Fraction(time) - Fraction(self.law.begin)
        whole = since // period
        since -= whole * period
        found = [Fraction(self.law.start) + whole * sum(Fraction(one.rise) for one in self.law.segments)]
        found += [Fraction(0), Fraction(0)]
        for one in self.law.segments:
            duration, powers = Fraction(one.duration), [Fraction(c) for c in SHAPES[one.law]]
            part = max(Fraction(0), min(Fraction(1), since / duration))
            for order in range(3):
                if order == 0 or 0 <= since < duration:
                    value = sum((c * part**k for k, c in enumerate(powers)), Fraction(0))
                    found[order] += Fraction(one.rise) * value / duration**order
                powers = [k * c for k, c in enumerate(powers)][1:]
            since -= duration
        return found

    def exact(self, driver: np.ndarray) -> tuple[Any, Any, Any]:
        """Position of the slider and its derivatives, at angle, speed and acceleration of the crank (3,)."""
        u, ud, udd = map(mp.mpf, driver.tolist())
        r, rod = mp.mpf(self.crank), mp.mpf(self.rod)
        c, s = mp.cos(u), mp.sin(u)
        b = mp.sqrt(rod**2 - (r * s) ** 2)
        slope = -r * s - r**2 * s * c / b
        curvature = -r * c - r**2 * ((c**2 - s**2) / b + r**2 * s**2 * c**2 / b**3)
        return r * c + b, slope * ud, curvature * ud**2 + slope * udd


def drawn(seed: int) -> Driven:
    """Return the law and the samples of a seed: there and back, in steps that add up, or with a dwell alone."""
    rng = Draw(seed)
    rises = [round(rng.uniform(-2.0, 2.0), rng.choice((1, 3, 15))) for _ in range(rng.randint(1, 3))]
    if seed % 2:  # there and back: numbers whose sum is not rounded
        rises = [round(rise * 1024.0) / 1024.0 for rise in rises]
        rises.append(-sum(rises))
    segments = []
    for rise in rises:
        duration = round(rng.uniform(0.05, 3.0), rng.choice((2, 15)))
        segments.append(Segment(rng.choice(("3-4-5", "4-5-6-7")), duration, rise))
        if rng.random() < 0.5:
            segments.append(Segment("dwell", round(rng.uniform(0.05, 1.0), rng.choice((2, 15)))))
    law = MotionSequence(
        tuple(segments), start=round(rng.uniform(-3.0, 3.0), 3), begin=rng.choice((0.0, 0.3)), repeat=True
    )
    period = sum(one.duration for one in segments)
    far = period * 10.0 ** rng.uniform(0.0, 6.0 if seed % 2 else 4.0)  # angles that add up are followed so far
    times = far + period * np.sort([rng.uniform(0.0, 2.5) for _ in range(SAMPLES)])
    crank = round(rng.uniform(0.2, 1.0), 3)
    return Driven(law, crank, round(crank * rng.uniform(1.5, 5.0), 3), times)


def compared(seed: int, engine: Literal["python", "native"]) -> Repeated:
    """Compare the run of a law with fractions, and the mechanism with its closed form."""
    driven = drawn(seed)
    found = Repeated(seed, f"{engine} engine", (0.0, 0.0, 0.0))
    run = kinfmu.solve(driven.mechanism, driven.times, engine=engine)
    if (run.status != 0).any():
        found.faults.append(f"status {run.status.max()} at sample {int(run.status.argmax())}")
        return found
    of_law = [driven.crank_at(float(time)) for time in driven.times]
    period = sum(one.duration for one in driven.law.segments)
    rises = abs(driven.law.start) + sum(abs(one.rise) for one in driven.law.segments)
    for order in range(3):
        wanted = [one[order] for one in of_law]
        errors = np.array(
            [abs(float(Fraction(float(k)) - w)) for k, w in zip(run.inputs[:, order], wanted, strict=True)]
        )
        largest = max(abs(float(one)) for one in wanted)
        moved = period * max(abs(one.rise) / one.duration ** (order + 1) for one in driven.law.segments)
        bound = ROUNDINGS * EPS * (largest + STEEPEST[order] * moved + (rises if order == 0 else 0.0))
        if errors.max() > bound:
            found.faults.append(f"derivative {order} of the law: error {errors.max():.1e} of {largest:.3g}")
    exact = [driven.exact(row) for row in run.inputs]
    column, worst = run.outputs.index("slider.x"), np.zeros(3)
    for order, table in enumerate((run.values, run.rates, run.accelerations)):
        errors = np.array(
            [abs(float(mp.mpf(float(k)) - one[order])) for k, one in zip(table[:, column], exact, strict=True)]
        )
        worst[order] = errors.max() / (max(abs(float(one[order])) for one in exact) or 1.0)
        k = int((errors - BEYOND * run.error[:, order]).argmax())
        if errors[k] > BEYOND * run.error[k, order]:
            found.faults.append(
                f"derivative {order}: error {errors[k]:.1e}, estimate {run.error[k, order]:.1e}, sample {k}"
            )
    found.errors = tuple(worst.tolist())
    return found


def _task(task: tuple[int, Literal["python", "native"]]) -> Repeated:
    return compared(*task)


def main() -> int:
    """Compare many laws and print what is found; 1 if anything is wrong."""
    parser = command_line("Long runs of repeating laws against 50 digits.", 2000)
    parser.add_argument("--engine", choices=["python", "native"], default="python", help="python by default")
    given = parser.parse_args()
    tasks = [(seed, given.engine) for seed in range(given.seed, given.seed + given.count)]
    found = all_compared(_task, tasks, given.jobs)
    worst = np.max([one.errors for one in found], axis=0)
    faulty = sum(bool(one.faults) for one in found)
    errors = ", ".join(f"{one:.1e}" for one in worst)
    print(f"{len(found)} laws, {given.engine} engine: worst errors {errors}; {faulty} at fault")
    return 1 if faulty else 0


if __name__ == "__main__":
    sys.exit(main())
