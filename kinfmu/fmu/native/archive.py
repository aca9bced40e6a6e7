"""The native flavour: an FMU of generated C, for co-simulation and model exchange, with its sources inside.

    modelDescription.xml
    documentation/index.html
    binaries/<platform>/<identifier>.so|dll|dylib
    sources/*.c, *.h                              all that `fmpy compile` and other tools need to compile it again
    sources/buildDescription.xml                  (FMI 3.0) the files to compile
    resources/mechanism.toml

It needs the C library only, has no global state and reads no file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from xml.etree.ElementTree import Element, SubElement

from kinfmu.codegen.c import compiler
from kinfmu.fmu import description
from kinfmu.fmu.archive import digest, token, zipped
from kinfmu.fmu.description import Description, FmiVersion
from kinfmu.fmu.description.common import document
from kinfmu.fmu.documents import Documents, licence
from kinfmu.fmu.interface import Drive, Interface
from kinfmu.fmu.native.platforms import PLATFORMS, Platform, host
from kinfmu.fmu.native.sources import headers, sources
from kinfmu.fmu.owned_motion import OwnedMotion
from kinfmu.fmu.variables import interface
from kinfmu.mechanism import toml_text
from kinfmu.plan import SolvePlan
from kinfmu.plan.forces import ForceSteps

OPTIMIZED = ("-O3", "-falign-functions=64", "-falign-loops=32")  # without alignment a step takes up to a tenth longer
FLAGS = (*OPTIMIZED, "-fvisibility=hidden", "-s")  # only FMI's functions are exported
_COMMON: dict[str, float | bool] = {"needsExecutionTool": False, "canBeInstantiatedOnlyOncePerProcess": False}
CAPABILITIES: dict[FmiVersion, dict[str, dict[str, float | bool]]] = {
    "2.0": {
        "ModelExchange": _COMMON
        | {"completedIntegratorStepNotNeeded": False, "canNotUseMemoryManagementFunctions": True}
        | {"canGetAndSetFMUstate": True, "canSerializeFMUstate": True, "providesDirectionalDerivative": True},
        "CoSimulation": _COMMON
        | {"canHandleVariableCommunicationStepSize": True, "canInterpolateInputs": True}
        | {"maxOutputDerivativeOrder": 2, "canRunAsynchronuously": False, "canNotUseMemoryManagementFunctions": True}
        | {"canGetAndSetFMUstate": True, "canSerializeFMUstate": True, "providesDirectionalDerivative": True},
    },
    "3.0": {
        "ModelExchange": _COMMON
        | {"canGetAndSetFMUState": True, "canSerializeFMUState": True, "providesDirectionalDerivatives": True}
        | {"providesAdjointDerivatives": True, "needsCompletedIntegratorStep": True},
        "CoSimulation": _COMMON
        | {"canGetAndSetFMUState": True, "canSerializeFMUState": True, "providesDirectionalDerivatives": True}
        | {"providesAdjointDerivatives": True, "canHandleVariableCommunicationStepSize": True}
        | {"maxOutputDerivativeOrder": 2, "hasEventMode": True},
    },
}
_OWNING = CAPABILITIES | {  # the integrator asks the host for its inputs, if the host wants that
    "3.0": CAPABILITIES["3.0"]
    | {"CoSimulation": CAPABILITIES["3.0"]["CoSimulation"] | {"providesIntermediateUpdate": True}}
}


def archive(
    plan: SolvePlan,
    drive: Drive,
    version: str,
    fmi: FmiVersion,
    platforms: str,
    progress: Callable[[int, int], None] | None = None,
    forces: Mapping[str, ForceSteps] = MappingProxyType({}),
    owned: OwnedMotion | None = None,
    documents: Documents | None = None,
) -> bytes:
    """Return the FMU of a plan; the same plan and the same compiler give the same bytes.

    Args:
        plan: Plan of the mechanism.
        drive: Default of the parameter `driven_by_time`: 'time' (true) or 'inputs' (false).
        version: Version of kinfmu.
        fmi: Version of FMI.
        platforms: 'host', compiled by the system's compiler, or 'all', compiled by zig.
        progress: Called with (platforms done, number of platforms).
        forces: Stages of the forces that are outputs, by part. Default: none.
        owned: Motion of the drivers, if efforts drive. Default: inputs or laws give it.
        documents: Makes documentation, icons and reference results. Default: none of these.

    Returns:
        Bytes of the zip archive.

    Raises:
        CompilerError: If no compiler is found.

    """
    starts, reach = owned.starts if owned else (), documents.reach if documents else None
    variables = interface(
        plan, drive, has_time=fmi == "3.0", has_work=owned is None, forces=forces, starts=starts, reach=reach
    )
    variables = variables.displayed_in(documents.display_length if documents else None)
    metadata = documents.metadata if documents else {}
    unnamed = _contents(plan, variables, version, fmi, "", forces, owned)
    contents = _contents(plan, variables, version, fmi, token(digest(unnamed)), forces, owned, metadata)
    wanted = [host()] if platforms == "host" else list(PLATFORMS)
    for done, platform in enumerate(wanted):
        if progress is not None:
            progress(done, len(wanted))
        target = None if platforms == "host" else platform.target
        contents[_binary(platform, variables, fmi)] = _compiled(contents, fmi, variables.name, platform, target)
    if progress is not None:
        progress(len(wanted), len(wanted))
    return zipped(contents | (documents.files(variables) if documents else {}))


def _contents(
    plan: SolvePlan,
    variables: Interface,
    version: str,
    fmi: FmiVersion,
    guid: str,
    forces: Mapping[str, ForceSteps],
    owned: OwnedMotion | None = None,
    metadata: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, bytes]:
    """Return every file except the binaries, by path in the FMU."""
    code = sources(
        plan,
        variables,
        fmi,
        guid,
        forces,
        owned.inertia if owned else None,
        owned.laws if owned else None,
    )
    units = tuple(compiler.units(code))
    about = Description(
        variables, guid, variables.name, f"kinfmu {version}", fmi, units if fmi == "2.0" else (), metadata
    )
    contents = {
        "modelDescription.xml": description.write(about, CAPABILITIES[fmi] if owned is None else _OWNING[fmi]),
        "documentation/licenses/license.txt": licence().encode(),
        "resources/mechanism.toml": toml_text.text(plan.mechanism).encode(),
    }
    if fmi == "3.0":
        contents["sources/buildDescription.xml"] = _build_description(variables.name, units)
    return contents | {f"sources/{name}": text.encode() for name, text in code.items()}


def _build_description(identifier: str, units: tuple[str, ...]) -> bytes:
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    options = {"compiler": "gcc", "compilerOptions": "-ffp-contract=off"}  # FMI has options of a named compiler only
    files = SubElement(configuration, "SourceFileSet", {"language": "C99", **options})
    for name in units:
        SubElement(files, "SourceFile", name=name)
    return document(root)


def _binary(platform: Platform, variables: Interface, fmi: FmiVersion) -> str:
    return f"binaries/{platform.folder(fmi)}/{variables.name}{platform.suffix}"


def _compiled(
    contents: Mapping[str, bytes], fmi: FmiVersion, identifier: str, platform: Platform, target: str | None
) -> bytes:
    """Return the library of one platform, compiled from the sources in the FMU."""
    files = {
        path.removeprefix("sources/"): data.decode()
        for path, data in contents.items()
        if path.startswith("sources/") and path.endswith((".c", ".h"))
    }
    own = (f"-Wl,-install_name,@rpath/{identifier}.dylib",) if platform.suffix == ".dylib" else ()
    return compiler.shared_library_bytes(files | headers(fmi), (*FLAGS, *own), target)
