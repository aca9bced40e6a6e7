"""Study: which designs are measured, over which motion, by which measures; from a file (TOML) or from arguments."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from kinfmu import VERSION
from kinfmu.analysis.measuring import driver_cycle
from kinfmu.arrays import FloatArray
from kinfmu.design.study.sampling import METHODS, Grid, Sampling, read_variation, whole_number
from kinfmu.errors import KinfmuError, MechanismError, RequestError, StudyError, listed, valid_names
from kinfmu.mechanism import Mechanism, RunSettings, gallery, toml_text
from kinfmu.mechanism.gallery.load import load_named_in
from kinfmu.mechanism.laws import ConstantSpeed
from kinfmu.mechanism.measures import Reading
from kinfmu.mechanism.mechanism import require_mechanism
from kinfmu.mechanism.number import read_constant
from kinfmu.mechanism.parameters import parameter_values
from kinfmu.mechanism.toml_document import check_keys, document_of, refuse_other_kind, table_of, text_in
from kinfmu.mechanism.toml_file import read_measures
from kinfmu.mechanism.valid import quoted
from kinfmu.motion.history import FEWEST
from kinfmu.motion.measure import with_measures
from kinfmu.motion.quantities import QuantityNames, coordinates_behind
from kinfmu.motion.reading_plan import dependent_numbers
from kinfmu.plan import compile_plan
from kinfmu.run import MOST_SAMPLES
from kinfmu.run.driving import numbers_of, run_times
from kinfmu.run.engine import require_engine
from kinfmu.run.model import WORTH_COMPILING, Model, compile  # noqa: A004  as re.compile
from kinfmu.units import Quantity

SAMPLES = 1000  # of sampled parameters, by default
SEED = 0
DESIGN = "design"
STATUS = "solver.status"
REASON = "reason"
OWN_COLUMNS = (DESIGN, STATUS, REASON)
MOST_OF_A_HYPERCUBE = 50_000_000  # numbers; a gigabyte while they are drawn
_SAMPLES_AT_ONCE = {"native": 1_500_000, "python": 200_000}  # of a part: 0.2 to 2 s
_MOST, _FEWEST = 4096, 32  # designs of a part
_PARTS = 32  # at least, so that all cores have work and progress shows


@dataclass(frozen=True, eq=False)
class StudyMotion:
    """The motion that every design makes.

    Attributes:
        t: (n,) times [s], for the laws of the file; None: driver values.
        inputs: Driver values as `solve` takes them; empty: times.
        over: Description of the motion, such as 'one turn of crank'.
        at_own_speed: Whether `inputs` are the cycle of the design as written, and each design makes its cycle with the
            start and the speed of its own law.

    """

    t: FloatArray | None
    inputs: Mapping[str, FloatArray | float]
    over: str
    at_own_speed: bool = False

    def __len__(self) -> int:
        arrays = [self.t] if self.t is not None else [np.atleast_1d(value) for value in self.inputs.values()]
        return max(len(array) for array in arrays)

    def as_json(self) -> dict[str, Any]:
        """Return what identifies the motion; long arrays by their hash."""
        given: dict[str, Any] = dict(self.inputs) if self.t is None else {"t": self.t}
        return {"over": self.over, **{name: _identified(value) for name, value in given.items()}}


@dataclass(frozen=True, eq=False)
class Study:
    """A study: the designs of a mechanism, the motion of each, and what is measured on it.

    Attributes:
        mechanism: The mechanism with the measures of the study.
        sampling: The parameters of the designs.
        motion: The motion that every design makes.
        engine: 'python' or 'native'.
        file_text: Text of the study file; '' if there is none.
        notes: Probable mistakes in the numbers of the parameters, a line each.

    """

    mechanism: Mechanism
    sampling: Sampling
    motion: StudyMotion
    engine: str
    file_text: str = ""
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.sampling)

    @property
    def measures(self) -> tuple[str, ...]:
        """Names of the measures."""
        return tuple(reading.name for reading in self.mechanism.measures)

    @cached_property
    def mechanism_text(self) -> str:
        """The mechanism as TOML."""
        return toml_text.text(self.mechanism)

    @cached_property
    def definition(self) -> dict[str, Any]:
        """All that the rows of the study follow from, except the mechanism, as plain data."""
        sampling = self.sampling
        return {
            "parameters": {one.name: one.as_json() for one in sampling.variations},
            "sampling": sampling.method if sampling.sampled else "grid",
            "samples": sampling.samples,
            "designs": len(sampling),
            "seed": sampling.seed,
            "motion": self.motion.as_json(),
            "engine": self.engine,
            "part": self.part_size,
        }

    @cached_property
    def fingerprint(self) -> str:
        """Hash of the definition, the mechanism and the version; equal ones give equal rows."""
        content = json.dumps(self.definition, sort_keys=True)
        return hashlib.sha256("\n".join((VERSION, content, self.mechanism_text)).encode()).hexdigest()

    @property
    def part_size(self) -> int:
        """Number of designs that are measured in one piece; it does not depend on the workers."""
        fitting = _SAMPLES_AT_ONCE[self.engine] // len(self.motion)
        wanted = min(fitting, -(-len(self) // _PARTS), _MOST)
        return max(wanted, min(_FEWEST, fitting), 1)

    @property
    def parts(self) -> range:
        """Numbers of the first designs of all parts."""
        return range(0, len(self), self.part_size)

    def part(self, first: int) -> dict[str, FloatArray]:
        """Return the parameters of the part that begins with a design, by name."""
        return self.sampling.values(first, min(self.part_size, len(self) - first))

    def model(self) -> Model:
        """Return the compiled mechanism, whose arguments are the varied parameters."""
        names = [one.name for one in self.sampling.variations if one.name in self.mechanism.parameters]
        outputs = coordinates_behind(QuantityNames(self.mechanism).quantities(*self.mechanism.measures))
        every = replace(self.mechanism, coordinates="all")
        return compile(every, outputs or None, parameters=names, engine=self.engine)


def define(
    mechanism: Mechanism | str | Path,
    parameters: Mapping[str, Any],
    *,
    measures: Iterable[Reading | str] | Reading | str | None = None,
    sampling: str = METHODS[0],
    designs: int = SAMPLES,
    seed: int = SEED,
    t: ArrayLike | None = None,
    over: str = "",
    engine: str = "auto",
    file_text: str = "",
    inputs: Mapping[str, ArrayLike] | None = None,
) -> Study:
    """Return a study; arguments as `kinfmu.study` has them.

    Raise a RequestError if an argument is invalid, a MechanismError if the mechanism or a table of a parameter is.

    over: Description of the motion. Default: made from it. file_text: Text of the study file.
    """
    if isinstance(mechanism, str | Path):
        mechanism = gallery.load(mechanism)
    require_mechanism(mechanism, "study")
    require_engine(engine)
    if sampling not in METHODS:
        raise RequestError(f"sampling = {quoted(sampling)} is not known{valid_names(str(sampling), METHODS)}")
    if not isinstance(parameters, Mapping) or not parameters:
        raise RequestError("a study needs [parameters]: which of them vary, and how")
    variations = tuple(
        read_variation(f"[parameters.{name}]", name, table, mechanism) for name, table in parameters.items()
    )
    is_sampled = any(not isinstance(one, Grid) for one in variations)
    count = whole_number("designs", designs, 1) if is_sampled else 1
    samples = Sampling(variations, sampling, count, whole_number("seed", seed, 0))
    whole_number("the number of designs, of all grids and samples together,", samples.grid_points * samples.samples, 1)
    _refuse_large_hypercube(samples)
    readings = with_measures(mechanism, measures).measures
    if not readings:
        raise RequestError(f"{mechanism.name} declares no measures; give some, as [measures] or measures=")
    mechanism = replace(mechanism, measures=readings)
    _refuse_equal_names([one.name for one in variations], [reading.name for reading in mechanism.measures])
    changed = law_changing(mechanism, [one.name for one in variations])
    motion = _motion(mechanism, t, inputs or {}, over, changes_law=bool(changed))
    if changed and motion.t is None and not motion.at_own_speed:
        raise RequestError(
            f"{changed[0]} changes a driver's law, which acts over time: give times "
            f"([run] start, stop and step in a study file) in place of driver values, or neither"
        )
    if len(motion) < FEWEST:
        raise RequestError(f"{motion.over}: measures need {FEWEST} samples or more, not {len(motion)}")
    if engine == "auto":
        engine = _engine(len(samples) * len(motion))
    return Study(mechanism, samples, motion, engine, file_text, tuple(_notes(mechanism, parameters)))


def _notes(mechanism: Mechanism, parameters: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """Yield a line for each parameter that has a bare number and another unit in the mechanism file."""
    for name, table in parameters.items():
        given = [table[key] for key in ("from", "to", "tolerance", "nominal") if key in table]
        text = mechanism.settable.note_on_bare(name, [*given, *table.get("values", ())])
        if text:
            yield f"[parameters] {text}"


def _refuse_large_hypercube(sampling: Sampling) -> None:
    """Raise a RequestError for a Latin hypercube that would fill the memory: it is drawn as a whole."""
    most = MOST_OF_A_HYPERCUBE // max(1, len(sampling.sampled))
    if sampling.method == METHODS[1] and sampling.samples > most:
        raise RequestError(
            f"designs = {sampling.samples}: a Latin hypercube is drawn as a whole and has at most {most} designs here; "
            f"Sobol points (sampling = '{METHODS[0]}') are drawn part by part"
        )


def _refuse_equal_names(parameters: Sequence[str], measures: Sequence[str]) -> None:
    """Raise a RequestError where two columns of the results would have one name."""
    taken = set(OWN_COLUMNS)
    for what, names in (("parameter", parameters), ("measure", measures)):
        for name in names:
            if name in taken:
                raise RequestError(f"the {what} '{name}' has the name of another column of the results; rename it")
            taken.add(name)


def _motion(
    mechanism: Mechanism, t: ArrayLike | None, inputs: Mapping[str, ArrayLike], over: str, *, changes_law: bool
) -> StudyMotion:
    """Return the motion: the times or driver values given, else one cycle of the driver or the run of the file.

    changes_law: Parameters of the study change the law of a driver; without a speed of its own it then makes its run.
    """
    if inputs and t is not None:
        raise RequestError(f"give times or inputs, not both: t and {listed(inputs)}")
    if t is not None:
        times = np.atleast_1d(_samples("t", t))
        return StudyMotion(times, {}, over or f"t = {times[0]:.6g} to {times[-1]:.6g} s")
    if inputs:
        arrays = {name: _samples(name, value) for name, value in inputs.items()}
        longest = max(arrays, key=lambda name: np.size(arrays[name]))
        values = np.atleast_1d(arrays[longest])
        return StudyMotion(None, arrays, over or f"{longest} = {values[0]:.6g} to {values[-1]:.6g}")
    can_cycle = not changes_law or isinstance(mechanism.drivers[0].law, ConstantSpeed)  # at the speed of each design
    if len(mechanism.drivers) == 1 and can_cycle:
        try:
            found, over = driver_cycle(compile_plan(mechanism))
        except KinfmuError as error:
            raise type(error)(f"the design as written has no motion: {error}", **error.data) from None
        if found and changes_law:
            turns = over.partition(" at ")[0]
            return StudyMotion(None, found, f"{turns} at the speed of each design", at_own_speed=True)
        if found:
            return StudyMotion(None, found, over)
    times = run_times(mechanism.run)
    return StudyMotion(times, {}, f"the run of the file, t = {times[0]:.6g} to {times[-1]:.6g} s")


def _samples(name: str, value: ArrayLike) -> FloatArray | float:
    array = numbers_of(name, value, "a number or an array of numbers")
    if array.ndim > 1 or not array.size:
        raise RequestError(f"{name} must be a number or (n,), not of shape {array.shape}")
    return array if array.ndim else float(array)


def _engine(samples: int) -> str:
    """Return the engine that pays for so many samples on this machine."""
    from kinfmu.codegen.c.compiler import command

    if samples < WORTH_COMPILING:
        return "python"
    try:
        command()
    except KinfmuError:
        return "python"
    return "native"


def _identified(value: FloatArray | float) -> Any:
    """Return a number, or what identifies an array."""
    if not isinstance(value, np.ndarray):
        return value
    digest = hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
    return {"from": float(value[0]), "to": float(value[-1]), "samples": len(value), "sha256": digest}


def law_changing(mechanism: Mechanism, names: Collection[str]) -> list[str]:
    """Return those of some parameters and law constants that change the law of a driver."""
    constants = {constant.name for constant in mechanism.law_constants}

    def is_behind_law(name: str) -> bool:
        places = dependent_numbers(mechanism, [name])
        return name in constants or any(place[0] == "drivers" and "law" in place for place in places)

    return [name for name in names if is_behind_law(name)]


def own_cycles(
    mechanism: Mechanism, cycle: Mapping[str, FloatArray | float], designs: Mapping[str, FloatArray]
) -> dict[str, Any]:
    """Return the driver values of one cycle at the start and the speed of each design, as `solve` takes them.

    They are (m, n) angles and speeds; of a single design (n,) and a number. cycle: That of the design as written,
    angles (n,) and speed by input; its single driver has a law `constant_speed`. designs: Arrays (m,) of what varies,
    by name.
    """
    (driver,) = mechanism.drivers
    law: Any = driver.law
    count = max(map(len, designs.values()))
    parameters = {name: values for name, values in designs.items() if name in mechanism.parameters}
    known = parameter_values(mechanism.parameters, parameters)
    own: dict[str, Any] = {}
    for key in ("start", "speed"):
        expression = mechanism.expressions.get(("drivers", driver.name, "law", key))
        written = getattr(law, key) if expression is None else expression.value(known)
        own[key] = np.broadcast_to(np.asarray(designs.get(f"{driver.name}.{key}", written), dtype=float), count)
    angle, speed, _ = driver.inputs()
    turned = np.asarray(cycle[angle]) - float(np.asarray(cycle[angle])[0])
    begin = own["start"] + own["speed"] * mechanism.run.start
    if count == 1:
        return {angle: begin[0] + turned, speed: float(own["speed"][0])}
    return {angle: begin[:, None] + turned, speed: np.repeat(own["speed"][:, None], len(turned), axis=1)}


KEYS = ("mechanism", "sampling", "designs", "seed", "report", "parameters", "measures", "run")
_TIMES, _VALUES = ("start", "stop", "step"), ("from", "to", "samples", "speed")


def read_study(path: str | Path, *, engine: str = "auto") -> Study:
    """Return the study of a file.

    Args:
        path: The file.
        engine: 'python', 'native' or 'auto'.

    Returns:
        The study. The path of its mechanism starts at the folder of the file.

    Raises:
        StudyError: The file cannot be read, or a table or a key is invalid.
        KinfmuError: The mechanism cannot be planned.

    """
    path = Path(path)
    try:
        text = text_in(path, "a study file")
        document = document_of(text, str(path))
    except MechanismError as error:
        raise StudyError(str(error)) from None
    try:
        return _study(document, path.parent, engine, text)
    except KinfmuError as error:
        raise StudyError(f"{path}: {error}", **error.data) from None


def _study(document: dict[str, Any], folder: Path, engine: str, text: str) -> Study:
    refuse_other_kind(document, "study", KEYS)
    check_keys("", document, KEYS)
    mechanism = load_named_in(document, folder)
    own = read_measures(document, folder)
    report = document.get("report")
    is_list = isinstance(report, list) and report and all(isinstance(name, str) for name in report)
    if report is not None and not is_list:
        raise StudyError(f"report = {quoted(report)} must be a list of names of measures")
    known = {reading.name: reading for reading in (*mechanism.measures, *own)}
    wanted = [known.get(name, name) for name in (known if report is None else report)]
    t, inputs = _motion_of_table(mechanism, table_of(document, "run"))
    return define(
        mechanism,
        table_of(document, "parameters"),
        measures=wanted,
        sampling=document.get("sampling", METHODS[0]),
        designs=document.get("designs", SAMPLES),
        seed=document.get("seed", SEED),
        t=t,
        inputs=inputs,
        engine=engine,
        file_text=text,
    )


def _motion_of_table(mechanism: Mechanism, table: Mapping[str, Any]) -> tuple[Any, dict[str, Any]]:
    """Return times, or driver values; neither without [run]."""
    where = "[run]"
    check_keys(where, table, (*_TIMES, *_VALUES))
    if not table:
        return None, {}
    both = [next((key for key in keys if key in table), None) for keys in (_TIMES, _VALUES)]
    if all(both):
        raise StudyError(
            f"{where} has '{both[0]}', a time, and '{both[1]}', of a driver's values: give start, stop and step, or "
            f"from, to, samples and speed"
        )
    if both[0]:
        written = {key: getattr(mechanism.run, key) for key in _TIMES}
        time = Quantity("time")
        settings = {
            key: read_constant(f"{where} {key}", table.get(key, written[key]), time, mechanism.length_unit)
            for key in _TIMES
        }
        if settings["step"] <= 0.0 or settings["stop"] < settings["start"]:
            raise StudyError(f"{where} must have a positive step, and stop after start")
        return run_times(RunSettings(settings["start"], settings["stop"], settings["step"])), {}
    if len(mechanism.drivers) != 1:
        names = ", ".join(driver.name for driver in mechanism.drivers)
        raise StudyError(
            f"{where} 'from' and 'to' are values of a single driver; here are {names}: give start and stop"
        )
    value, speed, _ = mechanism.drivers[0].inputs()
    for key in ("from", "to"):
        if key not in table:
            raise StudyError(f"{where} needs the key '{key}'")
    first, last = (
        read_constant(f"{where} {k}", table[k], value.quantity, mechanism.length_unit) for k in ("from", "to")
    )
    if first == last:
        raise StudyError(f"{where}: 'from' and 'to' are equal: {first:.9g}; measures need a driver that moves")
    samples = whole_number(f"{where} samples", table.get("samples", 361), FEWEST, MOST_SAMPLES)
    rate = read_constant(f"{where} speed", table.get("speed", 1.0), speed.quantity, mechanism.length_unit)
    if rate == 0.0:
        raise StudyError(f"{where} speed = {quoted(table['speed'])}: measures need a driver that moves")
    return None, {value: np.linspace(first, last, samples), speed: rate}
