"""Study files: TOML to Study. Messages state the file, the table, the key and what would be valid."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from kinfmu.design.study.definition import SAMPLES, SEED, Study, define
from kinfmu.design.study.sampling import METHODS, whole_number
from kinfmu.errors import KinfmuError, MechanismError, StudyError
from kinfmu.mechanism import Mechanism, RunSettings
from kinfmu.mechanism.gallery.load import load_named_in
from kinfmu.mechanism.number import read_constant
from kinfmu.mechanism.toml_document import check_keys, document_of, refuse_other_kind, table_of, text_in
from kinfmu.mechanism.toml_file import read_measures
from kinfmu.mechanism.valid import quoted
from kinfmu.motion.history import FEWEST
from kinfmu.run import MOST_SAMPLES
from kinfmu.run.driving import run_times
from kinfmu.units import Quantity

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
    t, inputs = _motion(mechanism, table_of(document, "run"))
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


def _motion(mechanism: Mechanism, table: Mapping[str, Any]) -> tuple[Any, dict[str, Any]]:
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
