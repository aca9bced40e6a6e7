"""kinfmu build: write a mechanism as an FMU; kinfmu verify: check a host by the reference results in one."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import click

from kinfmu.cli.arguments import InputFile, mechanism_argument, names_in, outputs_option
from kinfmu.cli.group import Progress, errors_of, main, note, patience
from kinfmu.cli.settings import checked_settings, set_option
from kinfmu.errors import KinfmuError, RequestError, listed
from kinfmu.files import suffix_of
from kinfmu.mechanism import gallery

if TYPE_CHECKING:
    from kinfmu.mechanism import Mechanism


@main.command(epilog="Example: kinfmu build crank_rocker --fmi 3 -o crank_rocker.fmu")
@mechanism_argument
@click.option(
    "-o",
    "output",
    type=click.Path(path_type=Path),
    help="The .fmu (or .ssp) to write, or its folder. Default: <name>.fmu in the current folder, or in its "
    "fmus/<name>/ for a mechanism of the gallery.",
)
@click.option(
    "--flavour",
    type=click.Choice(["python", "native"]),
    help="native: C, for every host; python: for hosts that contain Python, such as fmpy. Default: native if there is "
    "a C compiler, else python.",
)
@click.option(
    "--fmi",
    type=click.Choice(["2", "3"]),
    default="2",
    show_default=True,
    help="Version of FMI; the python flavour supports 2 only.",
)
@click.option(
    "--platforms",
    type=click.Choice(["host", "all"]),
    default="host",
    show_default=True,
    help="host: this machine, with its compiler; all: Linux, Windows and macOS, with zig. Native flavour only.",
)
@click.option(
    "--drive",
    type=click.Choice(["time", "inputs", "torque"]),
    help="What moves the drivers: time, by the laws of the file, or inputs such as crank_angle. Default: time, or "
    "inputs if a law is external. The FMU's parameter driven_by_time changes it. torque: efforts such as crank_torque "
    "are inputs, and the FMU integrates the motion.",
)
@click.option(
    "--page/--no-page",
    default=None,
    help="Put the page of kinfmu play into the FMU's documentation. Default: if the mechanism is not too large for it.",
)
@click.option(
    "--si",
    is_flag=True,
    help="Lengths of all variables in m, for hosts that convert no units; hosts that do show the file's unit. Angles, "
    "masses and forces are in SI units in any case.",
)
@click.option("--ssp", is_flag=True, help="Write an .ssp: the FMU, its connectors, a set of all parameters.")
@click.option(
    "--ssp-version",
    type=click.Choice(["1", "2"]),
    default="1",
    show_default=True,
    help="Version of SSP; 2 has enumerations, at which libcosim and Ecos end.",
)
@click.option(
    "--osp",
    is_flag=True,
    help="Write also <name>_OspModelDescription.xml next to the FMU: groups of variables, for libcosim.",
)
@click.option(
    "--certify",
    is_flag=True,
    help="Put the proof of the motion, of check --certify, into the FMU, too. Default: only the record of its checks, "
    "which verify prints.",
)
@outputs_option
@click.option(
    "--parameters",
    metavar="NAMES",
    help="Plain numbers of the file that become parameters of the FMU, too: all, lengths, masses, or names such as "
    "crank.P.x,AB.length. Default: only the [parameters] of the file.",
)
@click.option("--author", help="Author, stated in the FMU.")
@click.option("--model-version", "version", help="Version of the model, stated in the FMU.")
@click.option("--license", "license_", help="Licence of the model, stated in the FMU.")
@click.option("--copyright", "copyright_", help="Copyright, stated in the FMU.")
@click.option(
    "--date", help="Date, such as 2026-05-01, stated in the FMU. Default: none, so that two builds are equal."
)
@set_option
def build(
    mechanism: str,
    output: Path | None,
    flavour: str | None,
    fmi: str,
    platforms: str,
    drive: Any,
    page: bool | None,
    si: bool,
    ssp: bool,
    ssp_version: str,
    osp: bool,
    certify: bool,
    outputs: str | None,
    parameters: str | None,
    author: str | None,
    version: str | None,
    license_: str | None,
    copyright_: str | None,
    date: str | None,
    settings: tuple[tuple[str, str], ...],
) -> None:
    """Build the FMU of a mechanism.

    It supports co-simulation. A native FMU supports model exchange, too.
    """
    from kinfmu.analysis.file_notes import beyond_range
    from kinfmu.fmu import build as built
    from kinfmu.fmu.build import default_drive, default_flavour, native_obstacle, platforms_of

    for option, value, plain in (("--fmi", fmi, "2"), ("--platforms", platforms, "host")):
        if flavour == "python" and value != plain:
            raise click.UsageError(f"{option} {value} needs --flavour native; the python flavour has {option} {plain}")
    is_ssp = ssp or (output is not None and suffix_of(output) == ".ssp")
    if osp and is_ssp:
        raise click.UsageError("--osp describes an FMU for the folder that it is in; an .ssp holds none")
    mech = checked_settings(gallery.load(mechanism), settings).mechanism()
    drive = drive or default_drive(mech)
    stated = {"author": author, "version": version, "license": license_, "copyright": copyright_, "date": date}
    chosen = flavour or default_flavour(int(fmi), platforms)
    if si and mech.length_unit != "m" and (kept := _kept_numbers(mech)):
        note(
            f"{listed(kept)}: without a unit, so these parameters stay numbers in {mech.length_unit}; "
            f'give them one in the file: {kept[0]} = "{float(mech.parameters[kept[0]].value):g} {mech.length_unit}"'
        )
    with errors_of(mechanism), Progress("compiling for all platforms", least=2) as progress:
        path = built(
            mech,
            output or _place(mechanism, mech.name, ".ssp" if ssp else ".fmu"),
            flavour=chosen,
            drive=drive,
            outputs=names_in(outputs),
            parameters=names_in(parameters) or (),
            fmi=int(fmi),
            platforms=platforms,
            metadata={name: text for name, text in stated.items() if text is not None},
            si=si,
            ssp=int(ssp_version) if is_ssp else False,
            osp=osp,
            page=lambda: _page(mech, page),
            checks=find_spec("fmpy") is not None,
            certify=certify,
            progress=progress,
        )
    if drive == "time":
        for text in beyond_range(mech):
            note(text)
    is_native = chosen == "native"
    kinds = "co-simulation and model exchange" if is_native else "co-simulation"
    where = listed(platforms_of(path)) + ("" if is_native else " in hosts that contain Python")
    size = f"{path.stat().st_size / 1000.0:.0f} kB"
    held = "SSP with a " if suffix_of(path) == ".ssp" else ""
    click.echo(f"{path}: {size}, {held}{chosen} FMU for {where}, FMI {fmi}.0 {kinds}, driven by {drive}")
    if osp:
        click.echo(path.with_name(f"{mech.name}_OspModelDescription.xml"))
    obstacle = native_obstacle() if flavour is None and not is_native else ""
    if obstacle:
        click.echo(f"a native FMU, which every host can load, is not possible here: {obstacle}", err=True)


def _page(mechanism: Mechanism, wanted: bool | None) -> str:
    """Return the page of a mechanism, '' if it is not wanted, or if it was not asked for and cannot be made."""
    from kinfmu.page import page

    if wanted is False:
        return ""
    try:
        with patience(hint="; --no-page builds the FMU without it"):
            return page(mechanism)
    except RequestError as error:
        if wanted:
            raise
        note(f"the FMU is built without the page of kinfmu play: {error}")
        return ""


def _place(given: str, name: str, ending: str) -> Path:
    """Return <name>.fmu, in fmus/<name>/ of a checkout for a mechanism given by its name in the gallery."""
    own = Path("fmus") / name
    return (own if given in gallery.names() and own.is_dir() else Path()) / f"{name}{ending}"


def _kept_numbers(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the parameters whose quantity is unknown and whose numbers stay lengths in the mechanism's unit."""
    from kinfmu.mechanism.parameters import dimensions_of

    metric = mechanism.in_metres()
    pairs = [(one, metric.expressions[place]) for place, one in mechanism.expressions.items()]
    for name, one in mechanism.parameters.items():
        new = metric.parameters[name].expression
        if one.expression and new:
            pairs.append((one.expression, new))
    names = {name for old, new in pairs if old.text != new.text for name in old.names}
    known = dimensions_of(mechanism.parameters)
    return tuple(name for name in mechanism.parameters if name in names and not known[name].is_known)


@main.command(epilog="Example: kinfmu verify crank_rocker.fmu --results host.csv")
@click.argument("fmu", type=InputFile(".fmu", ".json"), metavar="FMU")
@click.option(
    "--results",
    type=InputFile(),
    help="Results of a host, as CSV: a column time, and outputs by name. Default: step the FMU with fmpy.",
)
@click.option(
    "--tolerance",
    type=click.FloatRange(min=0.0, min_open=True, max=1.0, max_open=True),
    help="Largest valid difference, relative to the largest number with the same unit; 1e-5 for hosts that write six "
    "digits. Default: that in the FMU: 1e-9, larger near singular points.",
)
@click.option(
    "--columns",
    metavar="NAMES",
    help="Only these outputs, such as crank.phi,'ram.*', with * for any letters. Default: all.",
)
def verify(fmu: Path, results: Path | None, tolerance: float | None, columns: str | None) -> None:
    """Check a host by the reference results in an FMU.

    An FMU of kinfmu holds the outputs at about 20 samples, in extra/org.kinfmu, with the step that belongs to them. An
    FMU that torques drive has none. Without --results its files, description and states are checked, too, and its
    certificate is proved again.

    A certificate (.json) of check --certificate, in place of an FMU, is proved again.
    """
    if suffix_of(fmu) == ".json":
        from kinfmu.analysis.certified.stored import proved_again

        click.echo(str(proved_again(fmu)))
        return
    from kinfmu.fmu import verify as verified

    if results is None:
        from kinfmu.fmu.conformance import NO_REFERENCE, conformance

        checks = [check for check in conformance(fmu) if check.name != "results" or check.text == NO_REFERENCE]
        for check in checks:
            click.echo(f"{check.name:<12}" + check.text.replace("\n", f"\n{'':<12}"))
        if wrong := [check for check in checks if not check.ok]:
            raise KinfmuError(f"{fmu}: {wrong[0].name}: {wrong[0].text}")
        if columns is None and any(check.text == NO_REFERENCE for check in checks):
            return
    found = verified(fmu, results, tolerance=tolerance, columns=names_in(columns))
    click.echo(str(found))
    if not found.ok:
        missing = found.missing and not found.is_shorter
        if found.left_out and found.difference <= found.tolerance and not missing:
            raise KinfmuError(
                f"{results or fmu}: {len(found.left_out)} of {len(found.left_out) + len(found.names)} outputs are not "
                f"in the results; to compare only some, name them: --columns {quote(','.join(found.names[:3]))}"
            )
        if len(found.missing) == found.samples or found.difference <= found.tolerance:
            raise KinfmuError(
                f"{results or fmu}: {len(found.missing)} of {found.samples} samples of the reference are missing"
            )
        raise KinfmuError(f"{results or fmu}: the results are not those of the reference")
