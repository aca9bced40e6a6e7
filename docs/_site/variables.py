"""The page of FMU variables: the variables of two FMUs of the gallery, from the list of which FMUs are built."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import fmpy

import kinfmu
from _site.pages import Pages, table

SHOWN = {
    "fourbar": "The four-bar of the gallery: one driver of an angle, no masses.",
    "engine": "The engine of the gallery: masses and a load, so forces and energies too.",
}
HEADINGS = {"input": "Inputs", "output": "Outputs", "parameter": "Parameters", "local": "Local variables"}


def write(pages: Pages) -> None:
    """Write reference/fmu-variables.md."""
    text = (
        "# FMU variables\n\nValue references count from 1 in this order and are equal in both flavours and both "
        "versions of FMI; FMI 3.0 adds `time` as the last. [FMUs](../fmu.md#variables) explains how they behave, "
        "[Notation](../notation.md#names-of-variables) how their names are formed.\n"
    )
    for name, words in SHOWN.items():
        text += f"\n## {kinfmu.load(name).title}\n\n{words}\n\n{_variables(name)}\n"
    pages.write("reference/fmu-variables.md", text)


def _variables(name: str) -> str:
    with tempfile.TemporaryDirectory() as folder:
        fmu = kinfmu.build(kinfmu.load(name), Path(folder) / "model.fmu", flavour="python")
        described = fmpy.read_model_description(fmu)
    parts = []
    for causality, heading in HEADINGS.items():
        rows = [
            (str(v.valueReference), f"`{v.name}`", v.unit or "", v.start or "", _meaning(v))
            for v in described.modelVariables
            if v.causality == causality
        ]
        if rows:
            parts.append(f"### {heading}\n\n{table(('', 'name', 'unit', 'start', 'meaning'), rows)}")
    return "\n\n".join(parts)


def _meaning(variable: Any) -> str:
    """Return the description of a variable, and its type if it is not a number."""
    kind = "" if variable.type == "Real" else f" ({variable.type})"
    return f"{variable.description or ''}{kind}"
