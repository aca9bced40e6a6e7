"""Fit files: TOML to FitProblem. Messages state the file, the table, the key and what would be valid."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from kinfmu.design.fit.constraints import CONSTRAINTS
from kinfmu.design.fit.problem import FitProblem
from kinfmu.design.fit.targets import TARGETS, FunctionTarget, PathTarget
from kinfmu.errors import MechanismError, RequestError, listed
from kinfmu.files import suffix_of
from kinfmu.mechanism.gallery.load import load_named_in
from kinfmu.mechanism.table_file import read_table
from kinfmu.mechanism.toml_file import document_of, text_in
from kinfmu.mechanism.toml_tables import check_keys, class_of_type, named_tables, refuse_other_kind, table_of, text_of

KEYS = ("mechanism", "over", "unknowns", "targets", "constraints")
_WITH_FILE = (PathTarget, FunctionTarget)  # their points can be in a CSV file


def read_problem(path: str | Path) -> FitProblem:
    """Return the problem of a fit file.

    Args:
        path: The file (.toml). A relative path of a mechanism in it starts in its folder.

    Raises:
        MechanismError: The file cannot be read or is invalid; the message states file, table and key.

    """
    path = Path(path)
    document = document_of(text_in(path, "a fit file"), str(path))
    try:
        return _problem(document, path.parent)
    except (MechanismError, RequestError) as error:
        raise MechanismError(f"{path}: {error}", **error.data) from None


def mechanism_file(path: Path) -> Path | None:
    """Return the mechanism file that a fit file names; None for a mechanism of the gallery."""
    name = document_of(text_in(path, "a fit file"), str(path)).get("mechanism")
    return path.parent / name if isinstance(name, str) and suffix_of(name) == ".toml" else None


def _problem(document: Mapping[str, Any], folder: Path) -> FitProblem:
    refuse_other_kind(document, "fit", KEYS)
    check_keys("", document, KEYS)
    over = document.get("over")
    return FitProblem(
        load_named_in(document, folder),
        table_of(document, "unknowns"),
        tuple(_members(document, "targets", TARGETS, folder)),
        tuple(_members(document, "constraints", CONSTRAINTS, folder)),
        None if over is None else text_of("over", over),
    )


def _members(document: Mapping[str, Any], table: str, classes: Iterable[Any], folder: Path) -> Iterable[Any]:
    """Yield the targets or constraints."""
    for name, values in named_tables(document, table):
        where = f"[{table}.{name}]"
        cls = class_of_type(where, values, "type", classes)
        own = [one for one in fields(cls) if one.name != "name"]
        with_file = cls in _WITH_FILE
        check_keys(where, values, ("type", *(one.name for one in own), *(("file",) if with_file else ())))
        keys = {key: value for key, value in values.items() if key not in ("type", "file")}
        if with_file and "file" in values:
            if "points" in values:
                raise MechanismError(f"{where} has both 'points' and 'file'; give one of them")
            keys["points"] = read_table(f"{where} file", values["file"], folder)
        for one in own:
            if one.default is MISSING and one.name not in keys:
                names = listed(key.name for key in own)
                or_file = " or 'file'" if one.name == "points" else ""
                raise MechanismError(f"{where} needs the key '{one.name}'{or_file}; keys: {names}")
        yield cls(name=name, **keys)
