"""Files in an FMU with their roles, by the layered standard FMI-LS-REF 1.0.0-beta.1 of FMI 2.0 and 3.0.

extra/org.fmi-standard.fmi-ls-ref/fmi-ls-manifest.xml    roles and digests of related files
extra/org.fmi-standard.fmi-ls-ref/<name>.ssv             all parameters, with their start values (SSP 1.0)
extra/org.fmi-standard.fmi-ls-ref/<name>.exp             the experiment of the reference results (ma-hs-experiments)
"""

from __future__ import annotations

from collections.abc import Mapping
from hashlib import sha3_256
from posixpath import relpath
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Element, SubElement

from kinfmu.fmu.description.common import document, text
from kinfmu.fmu.system_files import parameter_set

if TYPE_CHECKING:
    from kinfmu.fmu.interface import Interface
    from kinfmu.fmu.reference import ReferenceResults

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
MANIFEST = f"{FOLDER}/fmi-ls-manifest.xml"
_NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
_STANDARD = {
    "fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
    "fmi-ls-version": "1.0.0-beta.1",
    "fmi-ls-description": "Layered Standard providing information on related files included in an FMU.",
}
_RELATED = {  # by the end of a path: role, type, description
    "resources/mechanism.toml": ("model", "application/toml", "The mechanism file"),
    ".ssv": ("parameter", "application/x-ssp-parameter-set", "All parameters, with their start values"),
    ".exp": ("experiment/smoke-test", "application/x-ma-hs-experiments", "The experiment of the reference results"),
    "_ref.csv": ("result", "text/csv", "Reference results"),
    "documentation/index.html": ("document", "text/html", "Mechanism, drivers and variables"),
    "documentation/play.html": ("document", "text/html", "A page in which the mechanism is dragged"),
    "conformance.json": ("report", "application/json", "The checks of this FMU, by kinfmu verify"),
    "certificate.json": ("report", "application/json", "A proof of the motion, by kinfmu check --certify"),
}


def files(variables: Interface, found: ReferenceResults | None) -> dict[str, bytes]:
    """Return parameter set and experiment by path in the FMU; found: its reference results, if it has some."""
    name = variables.name
    contents = {f"{FOLDER}/{name}.ssv": parameter_set(variables)}
    if found is not None:
        results = f"../org.kinfmu/{name}"
        root = Element("Experiments", name=name, description=variables.title or name)
        experiment = SubElement(
            root, "Experiment", name="reference", description="The samples of the reference results"
        )
        times = {"startTime": found.t[0], "stopTime": found.t[-1], "stepSize": found.step}
        SubElement(experiment, "TransientSimulation", {key: text(float(value)) for key, value in times.items()})
        SubElement(experiment, "Parameters", source=f"{name}.ssv")
        if found.input_names:
            SubElement(experiment, "Stimuli", source=f"{results}_in.csv")
        SubElement(experiment, "References", source=f"{results}_ref.csv")
        contents[f"{FOLDER}/{name}.exp"] = document(root)
    return contents


def manifest(contents: Mapping[str, bytes]) -> bytes:
    """Return the manifest of an FMU; contents: its files by path."""
    root = Element("fmiReferences", {f"fmi-ls:{key}": value for key, value in _STANDARD.items()})
    root.set("xmlns:fmi-ls", _NAMESPACE)
    for end, (role, kind, description) in _RELATED.items():
        for path in sorted(path for path in contents if path.endswith(end)):
            source = relpath(path, FOLDER)
            digest = sha3_256(contents[path]).hexdigest()
            SubElement(root, "Related", type=kind, source=source, role=role, description=description, checksum=digest)
    return document(root)
