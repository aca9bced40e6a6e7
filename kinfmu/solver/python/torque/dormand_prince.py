"""Steps of the Runge-Kutta pair of Dormand and Prince of order 8 with error estimates of orders 5 and 3.

    k_s = f(t + c_s h, y + h sum_j a_sj k_j),   y(t + h) = y + h sum_s b_s k_s

Hairer, Norsett, Wanner: Solving Ordinary Differential Equations I, section II.10, program DOP853.
"""

from __future__ import annotations

from math import inf, sqrt

from ..pose import Vector
from .equation_of_motion import Course, StepEnd

SAFETY = 0.9
SHRINKS = 0.2  # a step is at least so much of the refused one
GROWS = 10.0  # and at most so much of the one before
STEEP = 1.0  # reaches that a driver moves in a step at most, so that no limit is passed in it
FIRST = 0.01  # reaches that it moves in the first step
LEAST = 10.0 * 2.220446049250313e-16  # of the time: a step is at least so long

ORDER = 8
STAGES = 12  # before that at the end of the step

C = (
    0.0,
    0.05260015195876773,
    0.0789002279381516,
    0.1183503419072274,
    0.2816496580927726,
    0.3333333333333333,
    0.25,
    0.3076923076923077,
    0.6512820512820513,
    0.6,
    0.8571428571428571,
    1.0,
)
A = (  # of the stages before each
    (),
    (0.05260015195876773,),
    (
        0.0197250569845379,
        0.0591751709536137,
    ),
    (
        0.02958758547680685,
        0.0,
        0.08876275643042054,
    ),
    (
        0.2413651341592667,
        0.0,
        -0.8845494793282861,
        0.924834003261792,
    ),
    (
        0.037037037037037035,
        0.0,
        0.0,
        0.17082860872947386,
        0.12546768756682242,
    ),
    (
        0.037109375,
        0.0,
        0.0,
        0.17025221101954405,
        0.06021653898045596,
        -0.017578125,
    ),
    (
        0.03709200011850479,
        0.0,
        0.0,
        0.17038392571223998,
        0.10726203044637328,
        -0.015319437748624402,
        0.008273789163814023,
    ),
    (
        0.6241109587160757,
        0.0,
        0.0,
        -3.3608926294469414,
        -0.868219346841726,
        27.59209969944671,
        20.154067550477894,
        -43.48988418106996,
    ),
    (
        0.47766253643826434,
        0.0,
        0.0,
        -2.4881146199716677,
        -0.590290826836843,
        21.230051448181193,
        15.279233632882423,
        -33.28821096898486,
        -0.020331201708508627,
    ),
    (
        -0.9371424300859873,
        0.0,
        0.0,
        5.186372428844064,
        1.0914373489967295,
        -8.149787010746927,
        -18.52006565999696,
        22.739487099350505,
        2.4936055526796523,
        -3.0467644718982196,
    ),
    (
        2.273310147516538,
        0.0,
        0.0,
        -10.53449546673725,
        -2.0008720582248625,
        -17.9589318631188,
        27.94888452941996,
        -2.8589982771350235,
        -8.87285693353063,
        12.360567175794303,
        0.6433927460157636,
    ),
)
B = (
    0.054293734116568765,
    0.0,
    0.0,
    0.0,
    0.0,
    4.450312892752409,
    1.8915178993145003,
    -5.801203960010585,
    0.3111643669578199,
    -0.1521609496625161,
    0.20136540080403034,
    0.04471061572777259,
)
E3 = (
    -0.18980075407240762,
    0.0,
    0.0,
    0.0,
    0.0,
    4.450312892752409,
    1.8915178993145003,
    -5.801203960010585,
    -0.4226823213237919,
    -0.1521609496625161,
    0.20136540080403034,
    0.02265179219836082,
    0.0,
)
E5 = (
    0.01312004499419488,
    0.0,
    0.0,
    0.0,
    0.0,
    -1.2251564463762044,
    -0.4957589496572502,
    1.6643771824549864,
    -0.35032884874997366,
    0.3341791187130175,
    0.08192320648511571,
    -0.022355307863886294,
    0.0,
)

_A = tuple(tuple((j, a) for j, a in enumerate(row) if a) for row in A)  # of stages that count
_B, _E3, _E5 = (tuple((j, b) for j, b in enumerate(row) if b) for row in (B, E3, E5))


class DormandPrince:
    """The integrator.

    Args:
        tolerance: Error of a step, relative, and absolute in rad and sizes, per second for speeds.
        size: Of the first step [s]; 0: from speeds and accelerations.

    Attributes:
        size: That the integrator would take next.

    """

    def __init__(self, tolerance: float, size: float = 0.0) -> None:
        self.tolerance, self.size = tolerance, size

    def begin(self, course: Course, at: StepEnd) -> None:
        """Choose the size of the first step."""
        self.size = self.size or _size_for(at, course.reach, FIRST)

    def step(self, course: Course, at: StepEnd, last: float, longest: float) -> StepEnd | None:
        """Return the end of a step, at `last` at the latest; None where no step succeeds."""
        least = LEAST * max(abs(at.t), abs(last))
        h = min(self.size, longest, _size_for(at, course.reach, STEEP))
        refused = False
        while True:
            is_last = h >= last - at.t - least
            h = last - at.t if is_last else h
            error, to = self._attempt(course, at, h, last if is_last else at.t + h)
            if to is not None:
                break
            course.here = at.pose
            refused = True
            h *= max(SHRINKS, SAFETY * error ** (-1.0 / ORDER)) if error < inf else SHRINKS
            if not h > least:
                return None
        grown = h * (min(GROWS, SAFETY * error ** (-1.0 / ORDER)) if error > 0.0 else GROWS)
        self.size = min(h, grown) if refused else max(grown, self.size) if is_last else grown
        return to

    def _attempt(self, course: Course, at: StepEnd, h: float, t: float) -> tuple[float, StepEnd | None]:
        """Return the error of a step of size h to t (1: that allowed; infinite: a pose is not reached), and its end."""
        k, n = [at.f], range(len(at.y))
        for c, row in zip(C[1:], _A[1:], strict=True):
            y = tuple([at.y[i] + h * sum([a * k[j][i] for j, a in row]) for i in n])
            f = course.derive(at.t + c * h, y)
            if f is None:
                return inf, None
            k.append(f)
        y = tuple([at.y[i] + h * sum([b * k[j][i] for j, b in _B]) for i in n])
        fifth = third = 0.0
        for i, scale in enumerate(course.reach * 2):
            if 2 * i >= len(y):
                scale = max(scale, abs(at.y[i]), abs(y[i]))
            fifth += (sum([e * k[j][i] for j, e in _E5]) / scale) ** 2
            third += (sum([e * k[j][i] for j, e in _E3]) / scale) ** 2
        error = fifth + 0.01 * third
        error = h * fifth / sqrt(error * len(y)) / self.tolerance if error > 0.0 else 0.0
        if not error < 1.0:
            return error, None
        end = course.complete(t, y)
        return (inf if end is None else error), end


def _size_for(at: StepEnd, reaches: Vector, share: float) -> float:
    """Return the size of a step in which no driver moves by more than `share` of its reach."""
    d, fastest = len(reaches), 0.0
    for k, full in enumerate(reaches):
        reach = share * full
        fastest = max(fastest, abs(at.y[d + k]) / reach + sqrt(abs(at.f[d + k]) / reach))
    return 1.0 / fastest if fastest > 0.0 else inf
