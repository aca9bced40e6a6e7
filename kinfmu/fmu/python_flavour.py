"""The python flavour: an FMU around pythonfmu's binaries that contains the solver as Python source.

    modelDescription.xml
    documentation/index.html
    binaries/<platform>/<identifier>.so|dll       pythonfmu's, unchanged
    resources/slavemodule.txt                     names the module that holds the slave class
    resources/<package>_slave.py                  the slave class, with its model and layout
    resources/<package>/solver/                   the solver, and the emitted model; forces, if they are outputs;
                                                  reduced inertia, if efforts drive
    resources/<package>/{fmu,pythonfmu}/          the base classes of the slave: kinfmu's and pythonfmu's
    resources/mechanism.toml

Hosts keep imported modules for the life of the process, and pythonfmu runs a slave's module twice. So the name of every
module contains the mechanism's name and a hash of the content, and importing it has no effects. The host may hold other
versions of `kinfmu` and `pythonfmu`, so copies of both are inside, under the name of the package.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Mapping, Sequence
from importlib.metadata import distribution
from importlib.resources import files
from types import MappingProxyType

from kinfmu.codegen.forces import STAGES, emit_jumps, emit_python_forces, solves
from kinfmu.codegen.python import emit
from kinfmu.codegen.python.stage import has_roots
from kinfmu.errors import FmuError
from kinfmu.fmu import description
from kinfmu.fmu.archive import digest, token, zipped
from kinfmu.fmu.documents import Documents
from kinfmu.fmu.interface import Drive, Interface
from kinfmu.fmu.licence import licence
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
RUN_TIME = ("slave.py", "slave_settings.py", "slave_outputs.py", "layout.py", "estimated_rates.py")  # of this package
BASE_CLASS = ("_version.py", "default_experiment.py", "enums.py", "fmi2slave.py", "logmsg.py", "variables.py")
WITH_FORCES = ("force_slave.py",)
WITH_EFFORTS = ("torque_slave.py",)
PARTS_WITH_START = (
    *("inputs", "constants", "parameters", "tolerance", "fixed", "drive", "rate_source", "loads"),
    *("states", "efforts"),
)

EXTERNAL_DEPENDENCIES = """\
This FMU runs Python code in the process of its host. It needs:

- a host process that holds Python 3.11 or newer, such as fmpy, libcosimpy or ecospy; other hosts cannot load it
- Linux (glibc 2.32 or newer) or Windows, on x86-64

It needs no Python packages: what it imports is the standard library and the modules in resources/.
An FMU of the same mechanism that needs none of this is the native one: kinfmu build MECH --flavour native
"""

_IMPORTS = """\
from {package}.fmu.layout import Layout, PartLayout
from {package}.fmu.{module} import {base}
from {package}.fmu.slave import hold
from {package}.solver import {modules}
"""
_ENTRY = '''"""The slave of the FMU '{name}'."""

{imports}
hold(globals())


class Slave({base}):
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
    contents = _contents(plan, variables, version, in_si, meets=meets)
    stages = dict(forces) | ({"inertia": owned.inertia} if owned else {})
    contents |= {
        f"kinfmu/solver/{stage}.py": emit_python_forces(plan, steps).encode() for stage, steps in stages.items()
    }
    if meets:
        stages["distances"] = distances
        text = f"{emit_python_forces(plan, distances)}\n\nMEETING = {meeting_messages(plan, distances)!r}\n"
        contents["kinfmu/solver/distances.py"] = text.encode()
    if any(map(has_roots, (*stages.values(), *([owned.laws.steps] if owned else [])))):
        contents["kinfmu/solver/roots.py"] = files("kinfmu.codegen.python").joinpath("roots.py").read_bytes()
    if any(map(solves, stages.values())):
        contents["kinfmu/solver/solutions.py"] = files("kinfmu.codegen.python").joinpath("solutions.py").read_bytes()
    if owned:
        contents["kinfmu/solver/jumps.py"] = emit_jumps(plan).encode()
        laws = f"{emit_python_forces(plan, owned.laws.steps)}\n\nCOUNTS = {owned.laws.counts!r}\n"
        contents["kinfmu/solver/laws.py"] = laws.encode()
        contents |= _modules("kinfmu.solver.python.torque", "kinfmu/solver/torque")
    added = (*(WITH_FORCES if stages else ()), *(WITH_EFFORTS if owned else ()))
    contents |= {f"kinfmu/fmu/{name}": files("kinfmu.fmu").joinpath(name).read_bytes() for name in added}
    metadata = documents.metadata if documents else {}
    named = _named(dict(sorted(contents.items())), variables, version, digest(contents), in_si, metadata, meets=meets)
    return zipped(named | (documents.files(variables) if documents else {}))


def _contents(
    plan: SolvePlan, variables: Interface, version: str, in_si: Sequence[float], *, meets: bool
) -> dict[str, bytes]:
    """Return every file by path in the FMU, still under the names `kinfmu` and `pythonfmu` and without a token."""
    import pythonfmu

    fmu, base = files("kinfmu.fmu"), files(pythonfmu)
    contents = {
        "modelDescription.xml": _description(variables, version, guid=""),
        "resources/mechanism.toml": toml_text.text(plan.mechanism).encode(),
        "kinfmu/__init__.py": b'"""The parts of kinfmu that this FMU needs."""\n',
        "kinfmu/fmu/__init__.py": b'"""The slave."""\n',
        "kinfmu/pythonfmu/__init__.py": b'"""The base class of pythonfmu."""\n',
        "kinfmu/solver/model.py": emit(plan).encode(),
        "kinfmu_slave.py": _entry(variables, "", in_si, meets=meets).encode(),
    }
    contents |= {f"kinfmu/fmu/{name}": fmu.joinpath(name).read_bytes() for name in RUN_TIME}
    contents |= _modules("kinfmu.solver.python", "kinfmu/solver")
    contents |= {f"kinfmu/pythonfmu/{name}": base.joinpath(name).read_bytes() for name in BASE_CLASS}
    contents |= {f"binaries/{name}": data for name, data in _binaries(variables.name).items()}
    contents |= _documents()
    return dict(sorted(contents.items()))


def _modules(package: str, folder: str) -> dict[str, bytes]:
    """Return the modules of a package by path in the FMU."""
    return {
        f"{folder}/{file.name}": file.read_bytes() for file in files(package).iterdir() if file.name.endswith(".py")
    }


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


def _entry(variables: Interface, token: str, in_si: Sequence[float], package: str = "kinfmu", *, meets: bool) -> str:
    parts = []
    for part in variables.parts:
        starts = tuple(variable.start for variable in part.variables) if part.name in PARTS_WITH_START else ()
        if part.name == "states":  # accelerations have no start
            starts = tuple(float(start or 0.0) for start in starts)
        parts.append(f"            PartLayout({part.name!r}, {part.names!r}, {starts!r}),")
    stages = [stage for stage in STAGES if variables.part(stage)]
    modules, attributes = [*stages, "model"], []
    if stages or in_si:
        positive = (one.name for one in variables.part("loads") if one.causality == "parameter" and one.minimum == 0.0)
        attributes.append(f"positive = {tuple(positive)!r}")
        attributes.append(f"stages = {{{', '.join(f'{one!r}: {one}.forces' for one in stages)}}}")
    if in_si:
        modules += ["inertia", "jumps", "laws"]
        attributes += ["inertia = staticmethod(inertia.forces)", "jumps = staticmethod(jumps.jumps)"]
        attributes += ["law_counts = laws.COUNTS", "laws = staticmethod(laws.forces)"]
        attributes.append(f"in_si = {tuple(in_si)!r}")
    if meets:
        modules.append("distances")
        attributes += ["meeting = distances.MEETING", "distances = staticmethod(distances.forces)"]
    base, module = ("ForceSlave", "force_slave") if stages else ("MechanismSlave", "slave")
    if in_si:
        base, module = "TorqueSlave", "torque_slave"
    return _ENTRY.format(
        name=variables.name,
        imports=_IMPORTS.format(package=package, module=module, base=base, modules=", ".join(sorted(modules))),
        base=base,
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
            module = _renamed(data.decode(), package)
            named[f"resources/{package}/{path.removeprefix('kinfmu/')}"] = module.encode()
        elif path != "modelDescription.xml":
            named[path] = data
    del named["kinfmu_slave.py"]
    named[f"resources/{package}_slave.py"] = _entry(variables, guid, in_si, package, meets=meets).encode()
    named["resources/slavemodule.txt"] = f"{package}_slave".encode()
    _check_imports(named, package)
    return named


def _renamed(source: str, package: str) -> str:
    """Return a module with its imports from kinfmu and pythonfmu changed to imports from `package`."""
    source = re.sub(r"^(\s*)from kinfmu\.solver\.python(?=[.\s])", r"\1from kinfmu.solver", source, flags=re.MULTILINE)
    source = re.sub(r"^(\s*)from kinfmu(?=[.\s])", rf"\1from {package}", source, flags=re.MULTILINE)
    return re.sub(r"^(\s*)from pythonfmu(?=[.\s])", rf"\1from {package}.pythonfmu", source, flags=re.MULTILINE)


def _check_imports(contents: Mapping[str, bytes], package: str) -> None:
    for path, data in contents.items():
        if not path.endswith(".py"):
            continue
        for node in ast.walk(ast.parse(data)):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and not node.level:
                names = [node.module or ""]
            for name in names:
                if name.partition(".")[0] not in (package, *sys.stdlib_module_names):
                    raise FmuError(f"{path} imports {name}; a python FMU may import the standard library only")
