"""Forces of random mechanisms against free-body diagrams in 50 digits: `python -m tests.stress.forces`.

Random masses, gravity and loads are put on the mechanisms of the families. Efforts by virtual work, reduced inertias,
reactions, shaking force and shaking moment are compared with those of `statics`; reactions and efforts have to balance
every body; and the work of efforts and loads over a stretch has to be the change of energy.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

import kinfmu
from kinfmu import (
    AngleBetween,
    ConstantSpeed,
    ConstantValue,
    Damper,
    ForceAlong,
    ForceAt,
    GasSpring,
    Mechanism,
    Run,
    Spring,
    TorqueOn,
    TorsionDamper,
    TorsionSpring,
)
from kinfmu.errors import AmbiguousStartError
from kinfmu.mechanism.toml_text import text
from tests.power_series import mp
from tests.stress.comparisons import all_compared, command_line
from tests.stress.families import Draw
from tests.stress.sensitivities import Floats
from tests.stress.statics import CONSERVATIVE, STANDING, Balance, Frame, Loads, Statics
from tests.stress.trial import Trial, trial

WRONG = 1e-12  # of the largest of its kind in the run
ENERGY = 1e-10  # of the energy that is exchanged over a stretch, and of the kinetic energy
REGULAR = 0.02  # margin; nearer to a singular point less than that is left of doubles
SAMPLES = 2  # of a mechanism
BLURS = 4  # roundings drawn; those of one may cancel
ROUNDINGS = 20.0  # a larger error than so many times that of rounded lengths and driver values is kinfmu's own
EPS = 2.0**-52
NATIVE_EVERY = 8  # one mechanism of so many is solved by the native engine
MARGIN, HALF = 0.1, 0.05  # of a stretch: margin at its middle, half width [rad, sizes]
NODES = (20, 80, 320)  # of Gauss; more where it does not converge with less, as near a narrow place
SHAKING = ("shaking_force_x", "shaking_force_y", "shaking_moment")
RATES = {"x": "vx", "y": "vy", "phi": "omega"}


@dataclass
class Comparison:
    """What a mechanism showed; errors are relative."""

    seed: int
    family: str
    efforts: float = 0.0
    inertias: float = 0.0
    reactions: float = 0.0
    balance: float = 0.0
    shaking: float = 0.0
    energy: float = 0.0
    samples: int = 0
    stretches: int = 0
    shared: int = 0
    blurred: int = 0
    skipped: str = ""
    faults: list[str] = field(default_factory=list)


def _number(value: float) -> float:
    return float(f"{value:.5g}")


def loaded(rng: Draw, one: Trial) -> Mechanism:
    """The mechanism of a trial with random masses, gravity and loads, in metres or millimetres."""
    mechanism, unit = one.drawn.mechanism, rng.choice(("m", "m", "mm"))
    size = float(one.drawn.frame.scale)
    metres = size * (0.001 if unit == "mm" else 1.0)

    def some(low: float, high: float, of: float = 1.0) -> float:
        return _number(rng.uniform(low, high) * of)

    bodies = []
    for body in mechanism.bodies:
        x, y = next(iter(body.points.values())) if body.is_ground else (0.0, 0.0)
        points = {**body.points, "load": (x + some(-1, 1, size), y + some(-1, 1, size))}
        if body.is_ground or rng.random() < 0.15:
            bodies.append(replace(body, points=points))
            continue
        center = some(-1, 1, size), some(-1, 1, size)
        mass = some(0.2, 3.0)
        bodies.append(
            replace(
                body, points=points, mass=mass, center_of_mass=center, inertia=some(0.0, 1.0, mass * metres * metres)
            )
        )
    moving = [body.name for body in mechanism.moving_bodies]
    places = [f"{body.name}.load" for body in mechanism.bodies]
    force, torque = metres, metres * metres

    def pair(of: Sequence[str]) -> tuple[str, str]:
        a, b = rng.sample(list(of), 2)
        return a, b

    names = ["ground", *moving]
    makers: list[Any] = [
        lambda n: ForceAt(n, f"{rng.choice(moving)}.load", some(-5, 5, force), some(-5, 5, force), rng.choice(names)),
        lambda n: ForceAlong(
            n, f"{rng.choice(moving)}.load", ConstantValue(some(-5, 5, force)), some(-3, 3), rng.choice(names)
        ),
        lambda n: Spring(n, pair(places), some(0.5, 5.0), some(0.0, 1.0, size), some(0.0, 1.0, force)),
        lambda n: Damper(n, pair(places), some(0.5, 5.0)),
        lambda n: GasSpring(
            n, pair(places), some(1, 2, size), some(0.5, 1, size), some(1, 2, force), some(2, 3, force)
        ),
        lambda n: TorsionSpring(n, pair(names), some(0.5, 5.0, torque), some(-1.0, 1.0)),
        lambda n: TorsionDamper(n, pair(names), some(0.5, 5.0, torque)),
        lambda n: TorqueOn(
            n,
            rng.choice(moving),
            ConstantSpeed(some(-1, 1, torque), some(-1, 1, torque)),
            over=AngleBetween(rng.choice(moving)),
        ),
    ]
    loads = [rng.choice(makers)(f"load{k}") for k in range(rng.randrange(4))]
    gravity = (some(-10, 10, size), some(-10, 10, size)) if rng.random() < 0.8 else None
    return replace(mechanism, bodies=tuple(bodies), gravity=gravity, loads=tuple(loads), length_unit=unit)


def compared(seed: int, family: str | None = None, engine: Literal["python", "native", ""] = "") -> Comparison:
    """Compare the forces of a random mechanism with free-body diagrams in 50 digits."""
    one = trial(seed, family)
    result = Comparison(seed, one.family)
    rng = Draw(seed)
    mechanism = loaded(rng, one)
    if not any(body.has_mass for body in mechanism.bodies) and not mechanism.loads:
        result.skipped = "neither masses nor loads"
        return result
    try:
        chosen: Any = engine or ("native" if seed % NATIVE_EVERY == 0 else "python")
        model = kinfmu.compile(mechanism, engine=chosen)
    except AmbiguousStartError:
        result.skipped = "ambiguous start"
        return result
    u, ud, udd = one.inputs
    names = [driver.inputs for driver in model.plan.drivers]
    inputs = {names[k][order]: table[:, k] for order, table in enumerate((u, ud, udd)) for k in range(len(names))}
    run = model.solve(**inputs)
    which = np.flatnonzero((run.status == 0) & (run.margin > REGULAR))
    if len(which) == 0:
        result.skipped = "no regular samples"
        return result
    size = float(one.drawn.frame.scale)
    for sample in sorted(rng.sample(which.tolist(), min(SAMPLES, len(which)))):
        _compare(result, mechanism, run, which, [table[sample] for table in one.inputs], sample, size)
    for sample in rng.sample(which.tolist(), min(3, len(which))):
        if run.margin[sample] > MARGIN and _stretch(result, mechanism, model, u[sample], ud[sample], size):
            break
    return result


def _compare(
    result: Comparison,
    mechanism: Mechanism,
    run: Run,
    which: Any,
    inputs: Sequence[Floats],
    sample: int,
    size: float,
) -> None:
    file = tomllib.loads(text(mechanism), parse_float=mp.mpf)
    statics = Statics(file)
    coordinates = [f"{body}.{c}" for body in statics.rows.bodies for c in ("x", "y", "phi")]
    guess = np.array([run[name][sample] if name in run.names else run.fixed[name] for name in coordinates])
    exact = statics.at(guess, *inputs, size)
    drivers = [(name, "torque" if of["type"] == "angle" else "force") for name, of in file["drivers"].items()]
    again: list[Balance] = []

    def judged(what: str, ours: Floats, part: Any, scale: Floats) -> float:
        """Relative error; 0 where the rounding of lengths and driver values already makes as much."""
        error = float((np.abs(ours - part(exact)) / scale).max(initial=0.0))
        if not error <= WRONG:
            if not again:
                rng = Draw(result.seed)
                for _ in range(BLURS):
                    blurred = tomllib.loads(
                        text(mechanism), parse_float=lambda s: mp.mpf(s) * (1 + EPS * rng.choice((1, -1)))
                    )
                    again.append(Statics(blurred).at(guess, *(table * (1 + EPS) for table in inputs), size))
            if error < ROUNDINGS * max(float((np.abs(part(b) - part(exact)) / scale).max(initial=0.0)) for b in again):
                result.blurred += 1
                return 0.0
            result.faults.append(f"sample {sample}: {what} wrong by {error:.2g}")
        return error

    columns = [f"{name}.{noun}" for name, noun in drivers]
    result.samples += 1
    ours = np.array([run[name][sample] for name in columns])
    largest = np.array([np.abs(run[name][which]).max() for name in columns])
    result.efforts = max(
        result.efforts, judged("efforts", ours, lambda b: b.efforts, np.where(largest > 0, largest, 1))
    )
    if f"{drivers[0][0]}.reduced_inertia" in run.force_names:
        matrix = np.zeros((len(drivers), len(drivers)))
        for k, (name, _) in enumerate(drivers):
            for j, (other, _) in enumerate(drivers[k:], start=k):
                column = f"{name}.reduced_inertia" + ("" if j == k else f".{other}")
                matrix[k, j] = matrix[j, k] = run[column][sample]
        diagonal = np.sqrt([np.abs(run[f"{name}.reduced_inertia"][which]).max() for name, _ in drivers])
        scale = np.outer(diagonal, diagonal)
        scale[scale < WRONG**2 * size * size] = 0.0  # a driver that moves no mass
        error = judged("reduced inertia", matrix, lambda b: b.inertias, np.where(scale > 0, scale, 1))
        result.inertias = max(result.inertias, error)
    _reactions(result, run, which, sample, statics, exact, judged, ours)
    columns = list(SHAKING)
    ours = np.array([run[name][sample] for name in columns])
    largest = np.array([np.abs(run[name][which]).max() for name in columns])
    terms = np.abs(exact.open).reshape(-1, 3)  # of the moving bodies; on the ground they may cancel
    force = max(terms[:, :2].sum() / float(statics.metre), largest[:2].max()) or 1.0
    arms = np.abs(guess.reshape(-1, 3)[:, :2])
    moment = max(terms[:, 2].sum() + (terms[:, :2] * arms[:, ::-1]).sum(), largest[2]) or 1.0
    scale = np.array([force, force, moment])
    result.shaking = max(result.shaking, judged("shaking force", ours, lambda b: b.shaking, scale))


def _reactions(
    result: Comparison,
    run: Run,
    which: Any,
    sample: int,
    statics: Statics,
    exact: Balance,
    judged: Any,
    efforts: Floats,
) -> None:
    assert run.reactions is not None
    of_joints = run.reactions[:, : len(statics.names)]
    assert tuple(map(str, run.reaction_names))[: len(statics.names)] == tuple(statics.names)
    ours = of_joints[sample]
    is_known = ~np.isnan(ours)
    result.shared += int((~is_known).sum())
    for name, known in zip(statics.names, is_known, strict=True):
        if known and name in exact.shared:
            result.faults.append(f"sample {sample}: {name} is given, but a self-stress may be added")
    is_moment = np.array([name.endswith(".moment") for name in statics.names])
    largest = np.ones(len(ours))
    with np.errstate(invalid="ignore"):
        for kind in (is_moment, ~is_moment):
            columns = np.abs(of_joints[which][:, kind & is_known])
            largest[kind] = columns.max(initial=0.0) or 1.0
    names = [name for name, known in zip(statics.names, is_known, strict=True) if known]
    result.reactions = max(
        result.reactions,
        judged(
            "reactions", ours[is_known], lambda b: np.array([b.reactions[name] for name in names]), largest[is_known]
        ),
    )
    multipliers = np.concatenate([ours, efforts]) / exact.per
    parts = exact.gradients * np.where(np.isnan(multipliers), 0.0, multipliers)[:, None]
    is_whole = (exact.gradients[np.isnan(multipliers)] == 0.0).all(axis=0)  # coordinates without undetermined reactions
    terms = np.abs(parts).sum(axis=0) + np.abs(exact.open)
    kinds = np.arange(len(terms)) % 3 == 2
    scale = np.where(kinds, terms[kinds].max(), terms[~kinds].max())
    off = np.abs(parts.sum(axis=0) - exact.open)[is_whole] / np.where(scale > 0, scale, 1)[is_whole]
    result.balance = max(result.balance, float(off.max(initial=0.0)))


def _stretch(
    result: Comparison, mechanism: Mechanism, model: kinfmu.Model, middle: Floats, speeds: Floats, size: float
) -> bool:
    """Judge the balance of energy around a sample; False if the motion there is not regular throughout."""
    rates = np.array([1.0 if driver.quantity.kind == "angle" else size for driver in model.plan.drivers])
    ud = np.sign(speeds) * np.maximum(0.2 * rates, np.minimum(np.abs(speeds), 1.5 * rates))
    half = HALF / np.abs(ud / rates).max()
    names = [driver.inputs for driver in model.plan.drivers]
    error = np.inf
    for count in NODES:
        nodes, weights = np.polynomial.legendre.leggauss(count)
        times = half * np.array([-1.0, *nodes, 1.0])
        inputs: dict[str, Any] = {names[k][0]: middle[k] + ud[k] * times for k in range(len(names))}
        inputs |= {names[k][1]: float(ud[k]) for k in range(len(names))}
        run = model.solve(**inputs)
        if (run.status != 0).any() or run.margin.min() < 0.5 * MARGIN:
            return False
        driving, lost = sum(run[f"{driver.name}.power"] for driver in model.plan.drivers), _lost(mechanism, run)
        power = driving + lost
        work = half * float(weights @ power[1:-1])
        energies = [run[name] for name in ("kinetic_energy", "potential_energy") if name in run.force_names]
        change = sum(float(energy[-1] - energy[0]) for energy in energies)
        exchanged = half * float(weights @ (np.abs(driving) + np.abs(lost))[1:-1]) + sum(
            float(np.ptp(energy)) for energy in energies
        )
        if energies[1:]:
            exchanged += float(energies[0].max())  # a balanced mechanism at constant speed exchanges none
        rounding = 8 * EPS * sum(float(np.abs(energy).max()) for energy in energies)
        error = max(0.0, abs(work - change) - rounding) / exchanged if exchanged > 0.0 else 0.0
        if error <= ENERGY:
            break
    result.stretches += 1
    result.energy = max(result.energy, error)
    if not error <= ENERGY:
        result.faults.append(f"work is not the change of energy: off by {error:.2g}")
    return True


def _lost(mechanism: Mechanism, run: Run) -> Any:
    """Power of the loads that store no energy, (n,)."""
    file = tomllib.loads(text(mechanism))
    metre = 0.001 if mechanism.length_unit == "mm" else 1.0
    frames = {"ground": STANDING}

    def column(name: str, rate: str | None = None) -> Any:
        if name in run.names:
            return run[rate or name]
        return np.full(len(run), 0.0 if rate else float(run.fixed[name]))

    for body in mechanism.moving_bodies:
        x, y, phi = (column(f"{body.name}.{c}") for c in RATES)
        vx, vy, omega = (column(f"{body.name}.{c}", f"{body.name}.{rate}") for c, rate in RATES.items())
        frames[body.name] = Frame(x * metre, y * metre, np.cos(phi), np.sin(phi), phi, vx * metre, vy * metre, omega)
    points = {
        f"{body}.{name}": point for body, of in file["bodies"].items() for name, point in of.get("points", {}).items()
    }
    exerted = Loads(file, points, float).exerted(frames, np.sqrt, but=CONSERVATIVE)
    power = np.zeros(len(run))
    for name, (x, y, moment) in exerted.items():
        power = power + x * frames[name].vx + y * frames[name].vy + moment * frames[name].omega
    return power


def _task(task: tuple[int, str | None, Any]) -> Comparison:
    try:
        return compared(*task)
    except Exception as error:  # it is a fault of this mechanism, and the next one goes on
        return Comparison(task[0], task[1] or "", faults=[f"{type(error).__name__}: {error}"])


def main() -> int:
    """Compare many mechanisms and print what is found; 1 if anything is wrong."""
    parser = command_line("Forces of random mechanisms against 50 digits.", 2000)
    parser.add_argument("--engine", default="", help="one engine for all; default: native for one mechanism of 8")
    given = parser.parse_args()
    tasks = [(seed, given.family, given.engine) for seed in range(given.seed, given.seed + given.count)]
    found = all_compared(_task, tasks, given.jobs)
    for what in ("efforts", "inertias", "reactions", "balance", "shaking", "energy"):
        worst = max(found, key=lambda one: float(getattr(one, what)))
        print(f"{what}: worst relative error {getattr(worst, what):.2g} (seed {worst.seed}, {worst.family})")
    print(
        f"{len(found)} mechanisms, {sum(one.samples for one in found)} samples, "
        f"{sum(one.stretches for one in found)} stretches, {sum(one.shared for one in found)} undetermined reactions; "
        f"{sum(bool(one.skipped) for one in found)} mechanisms skipped; {sum(one.blurred for one in found)} numbers "
        f"that lengths in doubles do not determine to 1e-12; {sum(bool(one.faults) for one in found)} at fault"
    )
    return 1 if any(one.faults for one in found) else 0


if __name__ == "__main__":
    sys.exit(main())
