"""The python flavour: an FMU around pythonfmu's binaries that contains the solver as Python source.

    modelDescription.xml
    documentation/index.html
    binaries/<platform>/<identifier>.so|dll       pythonfmu's, unchanged
    resources/slavemodule.txt                     names the module that holds the slave class
    resources/<package>_slave.py                  passes the slave class to the library
    resources/<package>/mechanism_slave.py        the slave class, with its model and layout
    resources/<package>/solver/python/            the solver, and the emitted model; forces, if they are outputs;
                                                  reduced inertia, if efforts drive
    resources/<package>/fmu/slave/                the base class of the slave
    resources/<package>/pythonfmu/                pythonfmu's base class
    resources/mechanism.toml

Hosts keep imported modules for the life of the process, and pythonfmu runs a slave's module twice. So the name of every
module contains the mechanism's name and a hash of the content, and importing it has no effects. The host may hold other
versions of `kinfmu` and `pythonfmu`, so copies of both are inside, under the name of the package. Their
modules import each other relatively.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import distribution
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType

from kinfmu.codegen.forces import STAGES, emit_jumps, emit_python_forces, solves
from kinfmu.codegen.python import emit
from kinfmu.codegen.python.stage import has_roots
from kinfmu.errors import FmuError
from kinfmu.fmu import description
from kinfmu.fmu.archive import digest, token, zipped
from kinfmu.fmu.documents import Documents, licence
from kinfmu.fmu.interface import Drive, Interface
from kinfmu.fmu.owned_motion import OwnedMotion
from kinfmu.fmu.variables import interface
from kinfmu.mechanism import toml_text
from kinfmu.plan import SolvePlan
from kinfmu.plan.efforts import units_in_si
from kinfmu.plan.forces import ForceSteps
from kinfmu.plan.undetermined import distance_steps, meeting_messages

CAPABILITIES = {
    "needsExecutionTool": True,  # Python, in the process of the host
    "canHandleVariableCommunicationStepSize": True,
    "canInterpolateInputs": False,  # pythonfmu's binary rejects input derivatives
    "canBeInstantiatedOnlyOncePerProcess": False,
    "canNotUseMemoryManagementFunctions": True,
    "canGetAndSetFMUstate": True,
    "canSerializeFMUstate": True,
    "providesDirectionalDerivative": False,  # pythonfmu's binary rejects all derivatives
}
BASE_CLASS = ("_version.py", "default_experiment.py", "enums.py", "fmi2slave.py", "logmsg.py", "variables.py")
WITH_EFFORTS = ("solver/python/torque/", "fmu/slave/efforts.py")
_PACKAGES = {  # docstrings of the packages inside
    "": "The parts of kinfmu that this FMU needs.",
    "fmu": "The slave.",
    "pythonfmu": "The base class of pythonfmu.",
    "solver": "The solver.",
}
_BASE = '''"""What a slave takes from pythonfmu: see the copy in this FMU."""

from ...pythonfmu.enums import Fmi2Status
from ...pythonfmu.fmi2slave import Fmi2Slave

__all__ = ["Fmi2Slave", "Fmi2Status"]
'''

EXTERNAL_DEPENDENCIES = """\
This FMU runs Python code in the process of its host. It needs:

- a host process that holds Python 3.11 or newer, such as fmpy, libcosimpy or ecospy; other hosts cannot load it
- Linux (glibc 2.32 or newer) or Windows, on x86-64
- to be unpacked below folders named by the letters A to Z and a to z, digits, blanks, and - . _ ~ only: elsewhere
  pythonfmu's library does not find its files, and ends the process of the host

It needs no Python packages: what it imports is the standard library and the modules in resources/.
An FMU of the same mechanism that needs none of this is the native one: kinfmu build MECH --flavour native
"""

_ENTRY = '''"""The slave of the FMU '{name}'."""

{imports}from .fmu.slave.layout import Layout, PartLayout
from .fmu.slave.slave import MechanismSlave
from .solver.python import {modules}


class Slave(MechanismSlave):
    """{title}"""

    model = model
{attributes}    layout = Layout(
        token={token!r},
        start_time={start!r},
        parts=(
{parts}
        ),
    )
'''

_MODULE = '''"""The module of the FMU '{name}' that pythonfmu's library runs for each instance."""

from {package} import mechanism_slave
from {package}.fmu.slave.library import hold

hold(globals(), mechanism_slave.Slave)
'''

_BY_EFFORTS = """\
by_efforts = staticmethod(
        partial(
            ByEfforts,
            inertia=inertia.forces,
            jumps=jumps.jumps,
            laws=laws.forces,
            law_counts=laws.COUNTS,
            in_si={in_si!r},
        )
    )"""


def archive(
    plan: SolvePlan,
    drive: Drive,
    version: str,
    forces: Mapping[str, ForceSteps] = MappingProxyType({}),
    owned: OwnedMotion | None = None,
    documents: Documents | None = None,
) -> bytes:
    """Return the FMU of a plan; the same plan gives the same bytes.

    Args:
        plan: Plan of the mechanism.
        drive: Default of the parameter `driven_by_time`: 'time' (true) or 'inputs' (false).
        version: Version of kinfmu.
        forces: Stages of the forces that are outputs, by part. Default: none.
        owned: Motion of the drivers, if efforts drive. Default: inputs or laws give it.
        documents: Makes documentation, icons and reference results. Default: none of these.

    Returns:
        Bytes of the zip archive.

    Raises:
        FmuError: If pythonfmu is installed without its binaries.

    """
    starts, reach = owned.starts if owned else (), documents.reach if documents else None
    variables = interface(plan, drive, forces=forces, starts=starts, reach=reach)
    variables = variables.displayed_in(documents.display_length if documents else None)
    in_si = units_in_si(plan) if owned else ()
    distances = distance_steps(plan)
    meets = bool(forces and distances.results)
    contents = _contents(plan, variables, version, owned)
    stages = dict(forces) | ({"inertia": owned.inertia} if owned else {})
    emitted = {"model": emit(plan)} | {stage: emit_python_forces(plan, steps) for stage, steps in stages.items()}
    if meets:
        stages["distances"] = distances
        emitted["distances"] = (
            f"{emit_python_forces(plan, distances)}\n\nMEETING = {meeting_messages(plan, distances)!r}\n"
        )
    if owned:
        emitted["jumps"] = emit_jumps(plan)
        emitted["laws"] = f"{emit_python_forces(plan, owned.laws.steps)}\n\nCOUNTS = {owned.laws.counts!r}\n"
    contents |= {f"kinfmu/solver/python/{name}.py": text.encode() for name, text in emitted.items()}
    codegen = files("kinfmu.codegen.python")
    if any(map(has_roots, (*stages.values(), *([owned.laws.steps] if owned else [])))):
        contents["kinfmu/solver/python/roots.py"] = codegen.joinpath("roots.py").read_bytes()
    if any(map(solves, stages.values())):
        contents["kinfmu/solver/python/solutions.py"] = codegen.joinpath("solutions.py").read_bytes()
    contents["kinfmu/mechanism_slave.py"] = _entry(variables, "", in_si, meets=meets).encode()
    metadata = documents.metadata if documents else {}
    contents = dict(sorted(contents.items()))
    named = _named(contents, variables, version, digest(contents), in_si, metadata, meets=meets)
    return zipped(named | (documents.files(variables) if documents else {}))


def _contents(plan: SolvePlan, variables: Interface, version: str, owned: OwnedMotion | None) -> dict[str, bytes]:
    """Return every file but emitted ones by path in the FMU, modules under the names `kinfmu` and `pythonfmu`."""
    import pythonfmu

    modules = _modules("solver/python") | _modules("fmu/slave") | {"fmu/slave/base.py": _BASE.encode()}
    if owned is None:
        modules = {name: data for name, data in modules.items() if not name.startswith(WITH_EFFORTS)}
    modules |= {f"pythonfmu/{name}": files(pythonfmu).joinpath(name).read_bytes() for name in BASE_CLASS}
    modules |= {f"{name}/__init__.py".lstrip("/"): f'"""{text}"""\n'.encode() for name, text in _PACKAGES.items()}
    return {
        "modelDescription.xml": _description(variables, version, guid=""),
        "resources/mechanism.toml": toml_text.text(plan.mechanism).encode(),
        **{f"kinfmu/{name}": data for name, data in modules.items()},
        **{f"binaries/{name}": data for name, data in _binaries(variables.name).items()},
        **_documents(),
    }


def _modules(folder: str) -> dict[str, bytes]:
    """Return the modules of a package of kinfmu by path."""
    package = Path(str(files("kinfmu"))) / folder
    return {f"{folder}/{file.relative_to(package).as_posix()}": file.read_bytes() for file in package.rglob("*.py")}


def _documents() -> dict[str, bytes]:
    """Return the documents: requirements of the FMU, and the licences of its contents."""
    return {
        "documentation/externalDependencies.txt": EXTERNAL_DEPENDENCIES.encode(),
        "documentation/licenses/license.txt": licence("pythonfmu, in pythonfmu.txt").encode(),
        "documentation/licenses/pythonfmu.txt": (
            distribution("pythonfmu").read_text("licenses/LICENSE") or "MIT, https://github.com/NTNU-IHB/PythonFMU\n"
        ).encode(),
    }


def _binaries(identifier: str) -> dict[str, bytes]:
    """Return pythonfmu's binaries by platform, under the FMU's model identifier."""
    import pythonfmu

    found = {}
    for platform in files(pythonfmu).joinpath("resources", "binaries").iterdir():
        for library in platform.iterdir():
            suffix = library.name.rpartition(".")[2]
            if suffix in ("so", "dll", "dylib"):
                found[f"{platform.name}/{identifier}.{suffix}"] = library.read_bytes()
    if not found:
        raise FmuError("pythonfmu is installed without its binaries; install the wheel: pip install pythonfmu")
    return found


def _description(
    variables: Interface, version: str, guid: str, metadata: Mapping[str, str] = MappingProxyType({})
) -> bytes:
    about = description.Description(variables, guid, variables.name, f"kinfmu {version}", metadata=metadata)
    return description.write(about, {"CoSimulation": CAPABILITIES})


def _entry(variables: Interface, token: str, in_si: Sequence[float], *, meets: bool) -> str:
    parts = [
        f"            PartLayout({part.name!r}, {part.type!r}, {part.names!r}, {part.starts!r}),"
        for part in variables.parts
    ]
    stages = [stage for stage in STAGES if variables.part(stage)]
    modules, attributes = [*stages, "model"], []
    imports = ""
    if stages or in_si:
        positive = (one.name for one in variables.part("loads") if one.causality == "parameter" and one.minimum == 0.0)
        attributes.append(f"positive = {tuple(positive)!r}")
        attributes.append(f"stages = {{{', '.join(f'{one!r}: {one}.forces' for one in stages)}}}")
    if in_si:
        modules += ["inertia", "jumps", "laws"]
        imports = "from functools import partial\n\nfrom .fmu.slave.efforts import ByEfforts\n"
        attributes.append(_BY_EFFORTS.format(in_si=tuple(in_si)))
    if meets:
        modules.append("distances")
        attributes += ["meeting = distances.MEETING", "distances = staticmethod(distances.forces)"]
    return _ENTRY.format(
        name=variables.name,
        imports=imports,
        modules=", ".join(sorted(modules)),
        attributes="".join(f"    {line}\n" for line in attributes),
        title=repr(variables.title or variables.name)[1:-1].replace('"', "'"),
        token=token,
        start=float(variables.experiment.start),
        parts="\n".join(parts),
    )


def _named(
    contents: Mapping[str, bytes],
    variables: Interface,
    version: str,
    digits: str,
    in_si: Sequence[float],
    metadata: Mapping[str, str],
    *,
    meets: bool,
) -> dict[str, bytes]:
    """Return the files under their final names; check that modules import only each other and the standard library."""
    package = f"kinfmu_{variables.name}_{digits[:12]}"
    guid = token(digits)
    named = {"modelDescription.xml": _description(variables, version, guid, metadata)}
    for path, data in contents.items():
        if path.startswith("kinfmu/"):
            named[f"resources/{package}/{path.removeprefix('kinfmu/')}"] = data
        elif path != "modelDescription.xml":
            named[path] = data
    named[f"resources/{package}/mechanism_slave.py"] = _entry(variables, guid, in_si, meets=meets).encode()
    named[f"resources/{package}_slave.py"] = _MODULE.format(name=variables.name, package=package).encode()
    named["resources/slavemodule.txt"] = f"{package}_slave".encode()
    _check_imports(named, package)
    return named


def _check_imports(contents: Mapping[str, bytes], package: str) -> None:
    for path, data in contents.items():
        if not path.endswith(".py"):
            continue
        for node in _statements(ast.parse(data)):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and not node.level:
                names = [node.module or ""]
            elif isinstance(node, ast.ImportFrom):
                folders = (*path.split("/")[: -node.level], *(node.module or "__init__").split("."))
                target = "/".join(folders)
                if not contents.keys() & {f"{target}.py", f"{target}/__init__.py"}:
                    raise FmuError(f"{path} imports {target}, which is not in the FMU")
            for name in names:
                if name.partition(".")[0] not in (package, *sys.stdlib_module_names):
                    raise FmuError(f"{path} imports {name}; a python FMU may import the standard library only")


def _statements(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield the statements of a module, also inner ones, without their expressions."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        for name in ("body", "orelse", "handlers", "finalbody", "cases"):
            waiting += getattr(node, name, ())
