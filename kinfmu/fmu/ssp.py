"""An FMU of kinfmu as an SSP (System Structure and Parameterization 1.0), a system of one component.

    SystemStructure.ssd          the component, its connectors with units, the default experiment
    resources/<name>.fmu
    resources/<name>.ssv         all parameters, with the values that the FMU starts with

Enumerations, the parameter `rates` and the output `solver.status`, are left out: libcosim and Ecos read none.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET
from xml.etree.ElementTree import Element, SubElement

from kinfmu.errors import FmuError
from kinfmu.files import write_whole
from kinfmu.fmu import description
from kinfmu.fmu.archive import zipped
from kinfmu.fmu.description import Description
from kinfmu.fmu.description.common import base_unit, text
from kinfmu.fmu.interface import Interface, Variable
from kinfmu.fmu.unpacked import DESCRIPTION, LARGEST_DESCRIPTION, text_in, unpacked

STRUCTURE = "SystemStructure.ssd"
PARAMETER_SET = "initialValues"  # the name that libcosim reads by default
_COMMON = "http://ssp-standard.org/SSP1/SystemStructureCommon"
_SSD = {"xmlns:ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription", "xmlns:ssc": _COMMON}
_SSV = {"xmlns:ssv": "http://ssp-standard.org/SSP1/SystemStructureParameterValues", "xmlns:ssc": _COMMON}
_CAUSALITIES = ("input", "output", "parameter", "calculatedParameter")


def write_ssp(fmu: Path, path: Path) -> Path:
    """Write the SSP of an FMU of kinfmu and return its path; the same FMU gives the same bytes.

    Args:
        fmu: The FMU.
        path: The .ssp to write.

    Raises:
        FmuError: The FMU cannot be read, or the file cannot be written.

    """
    with unpacked(fmu) as folder:
        about = description.read(text_in(fmu, folder, DESCRIPTION, LARGEST_DESCRIPTION).encode(), str(fmu))
    name = about.interface.name
    contents = {
        STRUCTURE: structure(about),
        f"resources/{name}.fmu": fmu.read_bytes(),
        f"resources/{name}.ssv": parameter_set(about.interface),
    }
    try:
        write_whole(path, zipped(contents, STRUCTURE))
    except OSError as error:
        raise FmuError(f"{path}: cannot be written ({error.strerror})") from None
    return path


def structure(about: Description) -> bytes:
    """Return SystemStructure.ssd: the FMU as the only component, with all its inputs, outputs and parameters."""
    interface = about.interface
    root = Element("ssd:SystemStructureDescription", _SSD, version="1.0", name=interface.name)
    root.set("generationTool", about.generation_tool)
    system = SubElement(root, "ssd:System", name=interface.name, description=interface.title or interface.name)
    elements = SubElement(system, "ssd:Elements")
    component = SubElement(
        elements,
        "ssd:Component",
        name=interface.name,
        type="application/x-fmu-sharedlibrary",
        source=f"resources/{interface.name}.fmu",
    )
    connectors = SubElement(component, "ssd:Connectors")
    seen = [variable for variable in interface if _is_shown(variable)]
    for variable in seen:
        connector = SubElement(connectors, "ssd:Connector", name=variable.name, kind=variable.causality)
        SubElement(connector, f"ssc:{variable.type}", {"unit": variable.unit} if variable.unit else {})
    bindings = SubElement(component, "ssd:ParameterBindings")
    SubElement(bindings, "ssd:ParameterBinding", source=f"resources/{interface.name}.ssv")
    units = SubElement(root, "ssd:Units")
    for name in sorted({variable.unit for variable in seen if variable.unit}):
        SubElement(SubElement(units, "ssc:Unit", name=name), "ssc:BaseUnit", base_unit(name))
    experiment = SubElement(root, "ssd:DefaultExperiment", startTime=text(float(interface.experiment.start)))
    if interface.experiment.stop > interface.experiment.start:
        experiment.set("stopTime", text(float(interface.experiment.stop)))
    return _document(root)


def parameter_set(interface: Interface) -> bytes:
    """Return the parameter set of an FMU: all its parameters with their start values and units."""
    root = Element("ssv:ParameterSet", _SSV, version="1.0", name=PARAMETER_SET)
    parameters = SubElement(root, "ssv:Parameters")
    for variable in interface:
        if variable.causality == "parameter" and variable.start is not None and _is_shown(variable):
            parameter = SubElement(parameters, "ssv:Parameter", name=variable.name)
            if variable.type == "Real":
                value = SubElement(parameter, "ssv:Real", value=text(float(variable.start)))
                if variable.unit:
                    value.set("unit", variable.unit)
            else:
                start = variable.start if variable.type == "Boolean" else int(variable.start)
                SubElement(parameter, f"ssv:{variable.type}", value=text(start))
    return _document(root)


def _is_shown(variable: Variable) -> bool:
    """Return True for connectors. Enumerations are none: libcosim and Ecos end at the first in a file."""
    return variable.causality in _CAUSALITIES and variable.type != "Enumeration"


def _document(root: Element) -> bytes:
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'.encode()
