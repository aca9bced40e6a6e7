"""Build the FMU of a mechanism."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from importlib.util import find_spec
from pathlib import Path

from kinfmu.errors import CompilerError, FmuError, RequestError, listed, valid_names
from kinfmu.files import suffix_of, temporary_folder
from kinfmu.fmu.archive import write
from kinfmu.fmu.description import FmiVersion
from kinfmu.fmu.interface import DRIVES, Drive
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.laws import External
from kinfmu.mechanism.mechanism import require_mechanism
from kinfmu.mechanism.opened import with_open_numbers
from kinfmu.version import VERSION

FLAVOURS = ("python", "native")
FMI_VERSIONS: dict[int, FmiVersion] = {2: "2.0", 3: "3.0"}
PLATFORMS = ("host", "all")


def build(
    mechanism: Mechanism,
    path: str | Path | None = None,
    *,
    flavour: str | None = None,
    drive: Drive | None = None,
    outputs: Sequence[str] | None = None,
    parameters: str | Sequence[str] = (),
    fmi: int = 2,
    platforms: str = "host",
    metadata: Mapping[str, str] | None = None,
    si: bool = False,
    ssp: bool | int = False,
    osp: bool = False,
    page: bool | Callable[[], str] = False,
    checks: bool = False,
    certify: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write the FMU of a mechanism and return its path.

    The same mechanism, compiled by the same compiler, gives the same bytes.

    Args:
        mechanism: Mechanism to build.
        path: File that ends in .fmu (or .ssp), or a folder. Default: `<name>.fmu` in the current folder.
        flavour: 'native' (C, for all hosts) or 'python' (through pythonfmu, for hosts that are Python processes).
            Default: native where a C compiler is found, else python.
        drive: Default of the parameter `driven_by_time`: 'time' (the laws in the file drive) or 'inputs'. Default:
            time, but inputs if a driver's law is external. 'torque': efforts such as crank_torque are inputs, and the
            FMU integrates angle and speed of each driver, or, in model exchange, declares them as states; the laws
            give their start values. The mechanism needs masses.
        outputs: Coordinates such as 'coupler.x', forces such as 'crank.torque' and reactions such as 'pin.force_x' that
            the FMU has. Default: all, with the forces of mechanisms with masses or loads, without reactions that
            redundant joints leave undetermined. What no output needs is not solved.
        parameters: Plain numbers of the file that become parameters, next to those of [parameters]: 'all', 'lengths',
            'masses', or names such as 'crank.P.x' and 'AB.length'; one of these or several. Default: none.
        fmi: Version of FMI, 2 or 3. The python flavour is FMI 2.0 only.
        platforms: Platforms of the native flavour: 'host' (compiled by the system's compiler) or 'all' (by zig).
        metadata: Texts of the model description by name: author, version, license, copyright, date. Default: none,
            also no date, so that two builds are equal.
        si: True: lengths of all variables are in m, which hosts show in the mechanism's unit (`displayUnit`). Angles,
            times, masses and forces are in SI units in every FMU. Default: lengths are in the mechanism's unit.
        ssp: True: write an .ssp that holds the FMU, with its connectors and a set of all parameters. 2: of SSP 2.0,
            with enumerations; True or 1: of SSP 1.0. Default: 1 if the path ends in .ssp.
        osp: True: write also `<name>_OspModelDescription.xml`, next to the FMU, with groups of variables for libcosim.
        page: True: put the page of `kinfmu play` into its documentation. Or a function that is
            called after the FMU is compiled and returns the page, '' for none. Default: no page.
        checks: True: check the FMU as `kinfmu verify` does, and put the record inside. Default: no checks.
        certify: True: the checks, and the proof of the motion of `kinfmu check --certify`. Default: no proof.
        progress: Called with (platforms done, number of platforms) during compilation.

    Returns:
        Path of the file.

    Raises:
        RequestError: If a choice or a number is unknown, or two choices exclude each other, or efforts do not determine
            the motion.
        MechanismError: If the mechanism is not valid.
        AssemblyError: If the mechanism cannot be assembled.
        CompilerError: If no compiler is found.
        FmuError: If the file cannot be written, or the FMU fails a check.

    """
    require_mechanism(mechanism, "build")
    drive = default_drive(mechanism) if drive is None else drive
    flavour = default_flavour(fmi, platforms) if flavour is None else flavour
    _check(flavour, drive, fmi, platforms, int(ssp))
    from kinfmu.fmu.documents import attributes, documents
    from kinfmu.fmu.force_variables import chosen_outputs, force_stages
    from kinfmu.plan import compile_plan
    from kinfmu.plan.forces import loaded_coordinates

    stated = attributes(metadata or {})
    path = _file(path, mechanism.name, ssp=bool(ssp))
    if osp and suffix_of(path) == ".ssp":
        raise RequestError("osp describes an FMU for the folder that it is in; an .ssp holds none")
    given, shown = mechanism, mechanism.length_unit
    mechanism = with_open_numbers(mechanism, parameters) if parameters else mechanism
    mechanism = mechanism.in_metres() if si else mechanism
    coordinates, names = chosen_outputs(mechanism, outputs)
    owned, forces = None, {}
    if drive == "torque":
        from kinfmu.fmu.owned_motion import owned_motion

        plan = compile_plan(mechanism, coordinates, solved=loaded_coordinates(mechanism))
        papers = documents(plan, fmi, stated, shown)
        plan, owned = owned_motion(plan)
    else:
        plan = compile_plan(mechanism, coordinates, solved=loaded_coordinates(mechanism) if names else ())
        papers = documents(plan, fmi, stated, shown)
    if names:
        forces = force_stages(plan, names, are_default=outputs is None)
    if flavour == "python":
        from kinfmu.fmu import python_flavour

        data = python_flavour.archive(plan, drive, VERSION, forces, owned, papers)
    else:
        from kinfmu.fmu.native import archive

        data = archive.archive(plan, drive, VERSION, FMI_VERSIONS[fmi], platforms, progress, forces, owned, papers)
    text = page() if callable(page) else _page_of(given) if page else ""
    return _written(path, data, text, osp=osp, ssp=int(ssp) or 1, checks=checks, certify=certify)


def _page_of(mechanism: Mechanism) -> str:
    from kinfmu.page import page  # it needs the report, which takes long to import

    return page(mechanism)


def _written(path: Path, data: bytes, page: str, *, osp: bool, ssp: int, checks: bool, certify: bool) -> Path:
    """Write an FMU, with page and checks, or the .ssp that holds it, and the description for OSP."""
    if suffix_of(path) == ".ssp":
        from kinfmu.fmu.system_files import write_ssp

        with temporary_folder() as folder:
            fmu = _written(folder / "model.fmu", data, page, osp=False, ssp=ssp, checks=checks, certify=certify)
            return write_ssp(fmu, path, ssp)
    from kinfmu.fmu.documents import PLACE, completed

    write(path, completed(data, {PLACE: page.encode()} if page else {}))
    if checks or certify:
        from kinfmu.fmu.conformance import record

        record(path, certify=certify)
    if osp:
        from kinfmu.fmu.system_files import write_osp

        write_osp(path)
    return path


def _check(flavour: str, drive: str, fmi: int, platforms: str, ssp: int) -> None:
    """Raise a RequestError for unknown choices and for choices that exclude each other."""
    if flavour not in FLAVOURS:
        raise RequestError(f"flavour '{flavour}' is not known{valid_names(flavour, FLAVOURS, 'flavours')}")
    if drive not in DRIVES:
        raise RequestError(f"drive = '{drive}' is not known{valid_names(drive, DRIVES)}")
    if fmi not in FMI_VERSIONS:
        raise RequestError(f"fmi = {fmi!r} is not known; known: {listed(map(str, FMI_VERSIONS))}")
    if ssp not in (0, 1, 2):
        raise RequestError(f"ssp = {ssp!r} is not known; versions of SSP: 1, 2")
    if platforms not in PLATFORMS:
        raise RequestError(f"platforms = '{platforms}' is not known{valid_names(platforms, PLATFORMS)}")
    if flavour == "python" and (fmi != 2 or platforms != "host"):
        choice = f"fmi = {fmi}" if fmi != 2 else f"platforms = '{platforms}'"
        raise RequestError(f"{choice} needs flavour = 'native'; the python flavour is FMI 2.0 on pythonfmu's platforms")


def default_drive(mechanism: Mechanism) -> Drive:
    """Return 'inputs' if a driver's law is external, else 'time'."""
    return "inputs" if any(isinstance(driver.law, External) for driver in mechanism.drivers) else "time"


def default_flavour(fmi: int = 2, platforms: str = "host") -> str:
    """Return the default flavour.

    Args:
        fmi: Version of FMI.
        platforms: 'host' or 'all'.

    Returns:
        'native' where a C compiler is found or the choices need it, else 'python'.

    """
    return "native" if (fmi, platforms) != (2, "host") or not native_obstacle() else "python"


def native_obstacle() -> str:
    """Return why no native FMU can be built for this machine, or an empty text."""
    from kinfmu.codegen.c import compiler
    from kinfmu.fmu.native.platforms import host

    try:
        host()
        compiler.command()
    except (CompilerError, FmuError) as error:
        return str(error)
    return "" if find_spec("fmpy") else "the headers of FMI, which fmpy carries, are missing; pip install fmpy"


def platforms_of(path: Path) -> tuple[str, ...]:
    """Return the platforms that an FMU, or the one in an .ssp, holds binaries for, such as 'x86_64-linux'."""
    from kinfmu.fmu.native.platforms import PLATFORMS as NATIVE_PLATFORMS

    with zipfile.ZipFile(path) as zipped:
        inside = next((name for name in zipped.namelist() if name.endswith(".fmu")), None)
        with zipfile.ZipFile(io.BytesIO(zipped.read(inside))) if inside else nullcontext(zipped) as fmu:
            folders = {name.split("/")[1] for name in fmu.namelist() if name.startswith("binaries/")}
    return tuple(one.name for one in NATIVE_PLATFORMS if folders & {one.name, one.fmi2})


def _file(path: str | Path | None, name: str, *, ssp: bool) -> Path:
    ending = ".ssp" if ssp else ".fmu"
    path = Path(f"{name}{ending}" if path is None else path)
    if path.is_dir():
        return path / f"{name}{ending}"
    if suffix_of(path) not in ((".ssp",) if ssp else (".fmu", ".ssp")):
        what = "a system ends in .ssp" if ssp else "an FMU ends in .fmu"
        raise RequestError(f"{path}: is no folder, and the file of {what}")
    return path
