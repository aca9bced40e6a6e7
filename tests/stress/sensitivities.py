"""Sensitivities of random mechanisms and of the gallery against differences of 50 digits.

`python -m tests.stress.sensitivities` compares random mechanisms, with --gallery every mechanism of the gallery, of
one mechanism of eight the sensitivities that C computes, or with --engine those of one engine.

The oracle reads the text of the mechanism's file and shares no code with kinfmu. It has three coordinates for each body
and the rows of all joints and drivers. Poses and rates for a length p + h and for p - h are found by Newton in 80
digits; their central difference has 50 correct ones, since h = 1e-30 of the size.
"""

from __future__ import annotations

import cmath
import sys
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

import kinfmu
from kinfmu.errors import AmbiguousStartError, InconsistentError, MobilityError
from kinfmu.mechanism.gallery import names
from kinfmu.mechanism.toml_text import text
from tests.mechanisms import with_open_lengths
from tests.power_series import Series, mp, sin_cos
from tests.stress.comparisons import all_compared, command_line
from tests.stress.families import Draw
from tests.stress.trial import trial

WRONG = 1e-10  # of the largest number of its kind, or of the derivative of a length or an angle of size 1
FAR = 1000  # sizes from the origin; lengths that are parameters are doubles
REGULAR = 0.02  # margin; nearer to a singular point less than 1e-10 is left of doubles
SAMPLES, LENGTHS = 2, 8  # at most, of each mechanism
GALLERY_TIMES = np.array([0.031, 0.117, 0.36, 0.57, 0.81])  # of the run of a mechanism of the gallery
GALLERY = -1  # in place of a seed
NAMES = [name for name in names() if name != "cam_roller"]  # whose curve is not among the rows below
STEP = mp.mpf("1e-30")
EPS = mp.mpf(2) ** -52
ROUNDINGS = 20.0  # a larger error than so many times that of rounded lengths and driver values is kinfmu's own
CLOSED = mp.mpf("1e-70")
OPENS = 1e-6  # gap per length of a row that opens; kinfmu refuses such a length
NATIVE_EVERY = 8  # one random mechanism of so many is solved by the native engine
ELSEWHERE = 10  # more samples at which a row may open

Engine = Literal["python", "native"]
Floats = NDArray[np.float64]


def turn(phi: Any) -> tuple[Any, Any]:
    """Cosine and sine of a number of any kind."""
    if isinstance(phi, complex):
        return cmath.cos(phi), cmath.sin(phi)
    sine, cosine = sin_cos(phi)
    return cosine, sine


def harmonic(law: Mapping[str, Any], x: Any) -> Any:
    """Output of a harmonic law with its keys in a file."""
    if law["law"] != "harmonic":
        raise NotImplementedError(law["law"])
    return law["start"] + law["amplitude"] * turn(x * law["frequency"] + law["phase"])[1]


class Rows:
    """The rows of a mechanism file for numbers of any kind, written here by hand."""

    def __init__(self, file: Mapping[str, Any]) -> None:
        self.bodies = [name for name in file["bodies"] if name != "ground"]
        self._file = file
        self.lengths: dict[str, Any] = {}
        self._expressions: dict[str, str] = {}  # parameters that follow from others
        for name, value in file.get("parameters", {}).items():
            try:
                self.lengths[name] = mp.mpf(float(str(value).split()[0]))  # doubles
            except ValueError:
                self._expressions[name] = value
        self.points = {
            f"{body}.{name}": point
            for body, of in file["bodies"].items()
            for name, point in of.get("points", {}).items()
        }

    def residual(self, q: Sequence[Any], u: Sequence[Any], lengths: Mapping[str, Any]) -> list[Any]:
        """All rows; q: x, y, phi of each moving body, u: driver values, lengths: by the names of parameters."""
        self._lengths = {**lengths, "sqrt": lambda x: x**0.5}
        for name, expression in self._expressions.items():
            self._lengths[name] = self._number(expression)
        poses = {name: q[3 * k : 3 * k + 3] for k, name in enumerate(self.bodies)}
        frames = {name: (x, y, *turn(phi)) for name, (x, y, phi) in poses.items()} | {"ground": (0, 0, 1, 0)}
        angles = {name: phi for name, (_, _, phi) in poses.items()} | {"ground": 0}

        def at(point: str) -> tuple[Any, Any]:
            x, y, c, s = frames[point.split(".")[0]]
            a, b = map(self._number, self.points[point])
            return x + c * a - s * b, y + s * a + c * b

        def between(joint: Mapping[str, Any]) -> tuple[Any, Any]:
            (x0, y0), (x1, y1) = map(at, joint["between"])
            return x1 - x0, y1 - y0

        def along(joint: Mapping[str, Any]) -> tuple[Any, Any]:
            """Parts of the distance along the axis of the first body and across it."""
            (dx, dy), (_, _, c, s) = between(joint), frames[joint["between"][0].split(".")[0]]
            axis = mp.mpf(joint["axis"])
            e, f = (cmath.cos(axis), cmath.sin(axis)) if isinstance(q[0], complex) else (mp.cos(axis), mp.sin(axis))
            ex, ey = c * e - s * f, s * e + c * f
            return ex * dx + ey * dy, ex * dy - ey * dx

        rows: list[Any] = []
        for joint in self._file["joints"].values():
            kind = joint["type"]
            if kind == "revolute":
                rows += between(joint)
            elif kind == "distance":
                dx, dy = between(joint)
                length = self._number(joint["length"])
                rows.append(dx * dx + dy * dy - length * length)
            elif kind == "point_on_line":
                rows.append(along(joint)[1])
            elif kind == "translational":
                first, second = (angles[point.split(".")[0]] for point in joint["between"])
                rows += [along(joint)[1], second - first - joint["angle"]]
            elif kind == "coordinate":
                rows.append(at(joint["of"])["xy".index(joint["axis"])] - self._number(joint.get("value", 0.0)))
            elif kind == "rack_and_pinion":
                turned = angles[joint["pinion"]] - angles[joint["between"][0].split(".")[0]]
                rows.append(along(joint)[0] - self._number(joint["radius"]) * turned - joint["offset"])
            elif kind == "gear":
                first, second = (angles[body] - angles[joint["carrier"]] for body in joint["between"])
                rows.append(second - first * joint["ratio"] - joint["offset"])
            elif kind == "cam_flat_face":
                cam, follower = (angles[point.split(".")[0]] for point in joint["between"])
                (dx, dy), (mx, my) = between(joint), turn(follower + joint["normal"])
                rows.append(mx * dx + my * dy - harmonic(joint, follower + joint["normal"] - cam))
            else:
                raise NotImplementedError(kind)
        for target, driver in zip(u, self._file["drivers"].values(), strict=True):
            if driver["type"] == "angle":
                rows.append(angles[driver["of"]] - target)
            elif driver["type"] == "slide":
                rows.append(along(driver)[0] - target)
            elif driver["type"] == "coordinate":
                rows.append(at(driver["of"])["xy".index(driver["axis"])] - target)
            else:
                dx, dy = between(driver)
                rows.append(dx * dx + dy * dy - target * target)
        return rows

    def _number(self, entry: float | str) -> Any:
        return eval(entry, {}, self._lengths) if isinstance(entry, str) else entry  # noqa: S307  of our files


class Oracle:
    """Poses and rates near one sample. guess: (3 n,) a pose in doubles."""

    def __init__(self, rows: Rows, lengths: Mapping[str, Any], guess: Floats, u: Floats, ud: Floats) -> None:
        self._rows, self._lengths = rows, lengths
        self._u = [Series([a, b]) for a, b in zip(u, ud, strict=True)]
        plain = {name: complex(value) for name, value in lengths.items()}
        columns = []
        for k in range(len(guess)):
            moved = [complex(value, 1e-30 * (j == k)) for j, value in enumerate(guess)]
            columns.append([complex(row).imag / 1e-30 for row in rows.residual(moved, [complex(x) for x in u], plain)])
        jacobian = np.array(columns).T
        *_, order = qr(jacobian.T, mode="economic", pivoting=True)
        self.chosen = sorted(order[: len(guess)].tolist())  # rows that determine the pose; the others are redundant
        self.others = [k for k in range(len(jacobian)) if k not in self.chosen]
        shifts = np.abs(jacobian[:, [k for k in range(len(guess)) if k % 3 != 2]]).max(axis=1)
        self._scales = np.where(
            shifts > 0.0, shifts, 1.0
        )  # of a row for a shift by 1: a redundant row's gap is a length
        inverse = np.linalg.inv(jacobian[self.chosen])
        self._inverse = mp.matrix(inverse.tolist())
        self.q, self.qd, _ = self.solved(lengths, [mp.mpf(x) for x in guess], [mp.mpf(0)] * len(guess))

    def solved(self, lengths: Mapping[str, Any], q: list[Any], qd: list[Any]) -> tuple[list[Any], list[Any], list[Any]]:
        """Pose, rates and the residuals of the redundant rows, by Newton with one Jacobian."""
        for _ in range(40):
            rows = self._rows.residual([Series([a, b]) for a, b in zip(q, qd, strict=True)], self._u, lengths)
            parts = [row.c if isinstance(row, Series) else [mp.mpf(row), mp.mpf(0)] for row in rows]
            steps = [self._inverse * mp.matrix([parts[k][order] for k in self.chosen]) for order in (0, 1)]
            q = [a - b for a, b in zip(q, steps[0], strict=True)]
            qd = [a - b for a, b in zip(qd, steps[1], strict=True)]
            if max(map(abs, (*steps[0], *steps[1]))) < CLOSED * (1 + max(map(abs, (*q, *qd)))):
                return q, qd, [parts[k][0] for k in self.others]
        raise ArithmeticError("Newton does not converge")

    def derivatives(self, name: str, h: Any) -> tuple[Floats, Floats, Floats]:
        """Derivatives of the pose, its rates and the redundant rows with respect to a length."""
        ahead, behind = (
            self.solved({**self._lengths, name: self._lengths[name] + sign * h}, self.q, self.qd) for sign in (1, -1)
        )
        pairs = zip(ahead, behind, strict=True)
        found = [[float((a - b) / (2 * h)) for a, b in zip(*pair, strict=True)] for pair in pairs]
        return np.array(found[0]), np.array(found[1]), np.array(found[2]) / self._scales[self.others]


@dataclass
class Comparison:
    """What a mechanism showed.

    worst: relative error of values and rates; compared: derivatives of lengths; blurred: those that the rounding of
    lengths to doubles already changes as much.
    """

    seed: int
    family: str
    worst: float = 0.0
    compared: int = 0
    refused: int = 0
    blurred: int = 0
    skipped: str = ""
    faults: list[str] = field(default_factory=list)


def compared(seed: int, family: str | None = None, engine: Engine | None = None) -> Comparison:
    """Compare the sensitivities of a random mechanism with differences of 50 digits."""
    one = trial(seed, family)
    result = Comparison(seed, one.family)
    mechanism = with_open_lengths(one.drawn.mechanism)
    try:
        model = kinfmu.compile(mechanism, engine=engine or ("native" if seed % NATIVE_EVERY == 0 else "python"))
    except AmbiguousStartError:
        result.skipped = "ambiguous start"
        return result
    except (InconsistentError, MobilityError):
        if max(map(abs, one.drawn.frame.at)) < FAR * one.drawn.frame.scale:
            raise
        result.skipped = "rows that are redundant in decimals are not in doubles so far from the origin"
        return result
    u, ud, _ = one.inputs
    rng = Draw(seed)
    names = [driver.inputs for driver in model.plan.drivers]
    inputs = {names[k][order]: table[:, k] for order, table in enumerate((u, ud)) for k in range(len(names))}
    run = model.solve(**inputs)
    which = np.flatnonzero((run.status == 0) & (run.margin > REGULAR))
    if len(which) == 0:
        result.skipped = "no regular samples"
        return result
    samples = sorted(rng.sample(which.tolist(), min(SAMPLES, len(which))))
    lengths = sorted(rng.sample(model.parameters, min(LENGTHS, len(model.parameters))))
    found = model.sensitivities(wrt=lengths, **inputs)
    _compare(result, mechanism, model, run, found, (u, ud), samples)
    return result


def compared_in_gallery(
    name: str, lengths: int | None = None, samples: slice = slice(None), engine: Engine = "python"
) -> Comparison:
    """Compare the sensitivities of a mechanism of the gallery with differences, over its own motion.

    Args:
        name: Name of the mechanism.
        lengths: How many of its lengths, at most. Default: all of them.
        samples: Which of GALLERY_TIMES. Default: all of them.
        engine: Of the model.

    """
    result = Comparison(GALLERY, name)
    mechanism = with_open_lengths(kinfmu.load(name))
    model = kinfmu.compile(mechanism, engine=engine)
    start, stop = mechanism.run.start, mechanism.run.stop
    t = start + (stop - start) * GALLERY_TIMES[samples]
    run = model.solve(t)
    assert (run.status == 0).all()
    inputs = run.inputs[:, ::3], run.inputs[:, 1::3]
    names = run.input_names
    driven = {str(names[3 * k + order]): inputs[order][:, k] for order in (0, 1) for k in range(len(names) // 3)}
    chosen = model.parameters[:: -(-len(model.parameters) // lengths)] if lengths else model.parameters
    found = model.sensitivities(wrt=chosen, **driven)
    _compare(result, mechanism, model, run, found, inputs, range(len(t)))
    return result


def _compare(
    result: Comparison,
    mechanism: kinfmu.Mechanism,
    model: kinfmu.Model,
    run: kinfmu.Run,
    found: Any,
    inputs: tuple[Floats, Floats],
    samples: Sequence[int],
) -> None:
    file = tomllib.loads(text(mechanism))
    rows = Rows(file)
    exact = rows.lengths
    size = model.plan.size
    coordinates = [f"{body}.{c}" for body in rows.bodies for c in ("x", "y", "phi")]
    places = [(coordinates.index(name), k) for k, name in enumerate(found.outputs) if name in coordinates]
    is_angle = np.array([coordinates[place].endswith("phi") for place, _ in places])
    opens: dict[str, float] = dict.fromkeys(found.parameters, 0.0)
    errors: dict[str, float] = {}
    rng = Draw(result.seed)
    blurred = {name: value * (1 + EPS * rng.choice((1, -1))) for name, value in exact.items()}
    for sample in samples:
        guess = np.array([run[name][sample] if name in run.names else run.fixed[name] for name in coordinates])
        oracle = Oracle(rows, exact, guess, inputs[0][sample], inputs[1][sample])
        reaches = [1.0 if driver.quantity.kind == "angle" else size for driver in model.plan.drivers]
        fastest = float((np.abs(inputs[1][sample]) / reaches).max())
        again: Oracle | None = None
        for p, name in enumerate(found.parameters):
            *theirs, of_rows = oracle.derivatives(name, STEP * mp.mpf(size))
            opens[name] = max(opens[name], float(np.abs(of_rows).max(initial=0.0)))
            if name in found.refused:
                continue
            ours = [table[sample, [k for _, k in places], p] for table in (found.values_by, found.rates_by)]
            exactly = [table[[place for place, _ in places]] for table in theirs]
            error = _largest(exactly, ours, is_angle, fastest, size)
            if error > WRONG:  # do rounded lengths and driver values give other derivatives, too?
                again = again or Oracle(rows, blurred, guess, inputs[0][sample] * (1 + float(EPS)), inputs[1][sample])
                other = [
                    table[[place for place, _ in places]] for table in again.derivatives(name, STEP * mp.mpf(size))[:2]
                ]
                if error < ROUNDINGS * _largest(exactly, other, is_angle, fastest, size):
                    result.blurred += 1
                    error = 0.0
            errors[name] = max(errors.get(name, 0.0), error)
    regular = np.flatnonzero((run.status == 0) & (run.margin > REGULAR))
    for sample in regular[:: max(1, len(regular) // ELSEWHERE)]:  # a gap may vanish at some poses
        doubted = [name for name in found.refused if opens[name] < OPENS]
        if doubted:
            guess = np.array([run[name][sample] if name in run.names else run.fixed[name] for name in coordinates])
            oracle = Oracle(rows, exact, guess, inputs[0][sample], inputs[1][sample])
            for name in doubted:
                opens[name] = float(np.abs(oracle.derivatives(name, STEP * mp.mpf(size))[2]).max(initial=0.0))
    _judge(result, found.refused, opens, errors)


def _largest(
    exactly: Sequence[Floats], ours: Sequence[Floats], is_angle: NDArray[np.bool_], fastest: float, size: float
) -> float:
    """Largest relative error of values and rates; derivatives of angles and of lengths have a scale each."""
    largest = 0.0
    for theirs, mine, unit in zip(exactly, ours, (1.0, fastest), strict=True):
        for kind, least in ((is_angle, unit / size), (~is_angle, unit)):
            scale = max(least, float(np.abs(theirs[kind]).max(initial=0.0))) or 1.0  # 0: at rest
            error = float(np.abs(mine - theirs)[kind].max(initial=0.0)) / scale
            largest = max(largest, error if np.isfinite(error) else np.inf)
    return largest


def _judge(
    result: Comparison, refused: Mapping[str, str], opens: Mapping[str, float], errors: Mapping[str, float]
) -> None:
    for name, gap in opens.items():
        if name in refused:
            result.refused += 1
            if gap < OPENS:
                result.faults.append(f"{name} is refused, but no row opens: {refused[name]}")
        elif gap > OPENS:
            result.faults.append(f"{name} opens a row by {gap:.2g}, and is not refused")
        else:
            result.compared += 1
            result.worst = max(result.worst, errors[name])
            if not errors[name] <= WRONG:
                result.faults.append(f"{name} is wrong by {errors[name]:.2g}")


def _task(task: tuple[int, str | None, Engine | None]) -> Comparison:
    seed, name, engine = task
    try:
        return (
            compared_in_gallery(name or "", engine=engine or "python")
            if seed == GALLERY
            else compared(seed, name, engine)
        )
    except Exception as error:  # it is a fault of this mechanism, and the next one goes on
        return Comparison(task[0], task[1] or "", faults=[f"{type(error).__name__}: {error}"])


def main() -> int:
    """Compare many mechanisms and print what is found; 1 if anything is wrong."""
    parser = command_line("Sensitivities of random mechanisms against 50 digits.", 1000)
    parser.add_argument("--gallery", action="store_true", help="the mechanisms of the gallery, and no others")
    parser.add_argument(
        "--engine",
        choices=get_args(Engine),
        help="one engine for all; default: both in the gallery, else native for 1 of 8",
    )
    given = parser.parse_args()
    tasks: list[tuple[int, str | None, Engine | None]] = [
        (seed, given.family, given.engine) for seed in range(given.seed, given.seed + given.count)
    ]
    if given.gallery:
        engines = [given.engine] if given.engine else get_args(Engine)
        tasks = [(GALLERY, name, engine) for name in NAMES for engine in engines]
    found = all_compared(_task, tasks, given.jobs)
    worst = max(found, key=lambda one: one.worst)
    skipped = [one.skipped for one in found if one.skipped]
    faulty = [one for one in found if one.faults]
    print(
        f"{len(found)} mechanisms, {sum(one.compared for one in found)} lengths compared, "
        f"{sum(one.refused for one in found)} refused; worst relative error {worst.worst:.2g} "
        f"(seed {worst.seed}, {worst.family}); {len(skipped)} mechanisms skipped; "
        f"{sum(one.blurred for one in found)} derivatives that are not determined to 1e-10 by lengths in doubles; "
        f"{len(faulty)} at fault"
    )
    return 1 if faulty else 0


if __name__ == "__main__":
    sys.exit(main())
