"""kinfmu export: write a run as a table, plot, animation or page; the file's ending chooses which."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from kinfmu.cli.arguments import STANDARD_OUTPUT, InputFile, OutputFile, RecordOrMechanism
from kinfmu.cli.export_formats import (
    PAGES,
    Options,
    mechanism_of,
    samples_between,
    write_animation,
    write_cam,
    write_drawing,
    write_page,
    write_plot,
    write_table,
)
from kinfmu.cli.group import errors_of, main
from kinfmu.cli.settings import checked_settings, csv_form, set_option, table_options
from kinfmu.errors import listed
from kinfmu.files import suffix_of
from kinfmu.mechanism import gallery

if TYPE_CHECKING:
    from kinfmu.run import Run

RECORD = ".mcap"


class Format(NamedTuple):
    """A kind of file that shows a run.

    name: in messages; write: its writer; options: parameters of the command that belong to it; also: others that it
    takes, which messages attribute to another format.
    """

    name: str
    suffixes: tuple[str, ...]
    write: Callable[[Run, Path, Options], None]
    options: tuple[str, ...]
    also: tuple[str, ...] = ()


TABLES = Format("tables", (".csv", ".xlsx", ".parquet", ".npz"), write_table, ("columns",), also=("svaj", "degrees"))
PLOTS = Format(
    "plots",
    (".svg", ".png", ".pdf"),
    write_plot,
    ("across", "overlay", "polar", "other", "svaj", "degrees", "columns"),
)
ANIMATIONS = Format("animations", (".gif", ".mp4"), write_animation, ("width",))
DRAWINGS = Format("", (".dxf",), write_drawing, ("at",))
KINDS = (TABLES, PLOTS, ANIMATIONS, DRAWINGS)
FORMATS = tuple(suffix for kind in KINDS for suffix in kind.suffixes)
_LABELS = {  # of parameters, in messages, before their values where these are shown
    "across": "--x",
    "overlay": "--overlay",
    "polar": "--polar",
    "other": "a second run",
    "svaj": "--svaj",
    "degrees": "--degrees",
    "at": "--at {}",
    "width": "--width {}",
    "columns": "--columns {}",
}


@main.command(epilog="Example: kinfmu export logs/crank_rocker.mcap -o run.svg --columns tracer.x,tracer.y")
@click.argument("run", type=RecordOrMechanism(), metavar="RUN|MECH")
@click.argument("other", required=False, type=InputFile(".mcap"))
@click.option(
    "-o",
    "output",
    type=OutputFile(*FORMATS, *PAGES, or_standard_output=True),
    required=True,
    help=f"The file to write: {listed((*FORMATS, *PAGES))}; - prints a table as CSV.",
)
@click.option(
    "--columns",
    metavar="NAMES",
    help="Columns of a table or a plot, with the names of simulate --channels: coupler.x, 'coupler.*', q, crank_angle, "
    "solver.margin, -error. A table always contains time and status. Default: all columns; for plots the six panels "
    "that show most of the motion, with a line that names the others.",
)
@click.option(
    "--x",
    "across",
    metavar="NAMES",
    help="The column along the horizontal axis of a plot, or one for each column: --x P.x,Q.x --columns P.y,Q.y.",
)
@click.option("--overlay", is_flag=True, help="Plot columns of one unit in one panel: --columns left.phi,right.phi.")
@click.option("--polar", is_flag=True, help="Plot over the polar angle: the driver's, or that of --x.")
@click.option(
    "--svaj",
    metavar="NAME",
    help="Plot displacement, velocity, acceleration and jerk over the driver, of a coordinate such as slider.x or of a "
    "cam joint's lift, or write them as a table.",
)
@click.option(
    "--degrees/--radians",
    default=None,
    help="Unit of angles, and of their rates in time. Default: degrees in plots, where driver values and those of --x "
    "always have them, and in .xlsx; radians in other tables and --svaj.",
)
@click.option(
    "--start", metavar="VALUE", help="First sample: time [s], or driver value of solve --angle, such as 30deg."
)
@click.option("--stop", metavar="VALUE", help="Last sample: time [s], or driver value of solve --angle, such as 90deg.")
@click.option(
    "--at", metavar="VALUE", help="Time or driver value of a .dxf drawing, such as 45deg. Default: the first."
)
@click.option(
    "--width",
    metavar="PIXELS",
    type=int,
    help="Width of a .gif or .mp4; neither side may be longer than 1920 pixels. Default: about 600.",
)
@click.option(
    "--cam",
    metavar="JOINT",
    help="Write the profile of a cam, by its joint: as a table, a figure with pressure angle and curvature, or .dxf.",
)
@click.option(
    "--tolerance",
    metavar="LENGTH",
    help="Largest distance of the polygon of a cam's .dxf from the curve, such as 0.01mm. Default: 1e-5 of the cam.",
)
@table_options
@set_option
def export(run: str, output: Path, cam: str | None, settings: tuple[tuple[str, str], ...], **options: Any) -> None:
    """Write a run as a table, plot, animation or page.

    Or a mechanism as a page: a page (.html) is the mechanism, to be dragged in a browser, with the parameters and the
    time of the run; it is one file, works offline, and computes with the compiled code of the FMU.

    RUN is a record (.mcap) of simulate or solve. Tables but .csv always contain the units. Plots (.svg, .png, .pdf)
    show coordinates, velocities and accelerations against time, or against the driver of a solve --angle. With --x,
    --overlay or --polar, exactly the named columns are curves. OTHER is a second run for the same plot. A .gif or
    .mp4 shows the moving linkage, a .dxf the pose at a value as a CAD drawing. With --cam, a mechanism or a record
    gives the profile of a cam as a table, .dxf or a figure. --set is for mechanisms: a record has the values of its
    run.
    """
    is_record = suffix_of(run) == RECORD
    if settings and is_record:
        raise click.UsageError(
            f"--set {settings[0][0]}: only for mechanisms; {run} has the values of its run: use solve --set or "
            "simulate --set"
        )
    if options["width"] is not None:
        _check_width(options["width"])
    about = ""
    if cam is not None:
        _check_options_of_cam(cam)
        about = write_cam(run, output, cam, settings, options)
    elif options["tolerance"] is not None:
        raise click.UsageError(f"--tolerance {options['tolerance']}: only for the .dxf of a cam, with --cam")
    elif suffix_of(output) in PAGES or not is_record:
        _write_page(run, output, settings, options)
    else:
        suffix = ".csv" if output == STANDARD_OUTPUT else suffix_of(output)
        form = csv_form(suffix, TABLES.suffixes, options)
        _refuse_other_formats(suffix, options)
        from kinfmu.log import read

        part = samples_between(read(Path(run)), options["start"], options["stop"])
        kind = next(kind for kind in KINDS if suffix in kind.suffixes)
        kind.write(part, output, {**options, "run": run, "form": form})
    if output != STANDARD_OUTPUT:
        click.echo(f"written: {output}{about}")


def _label(name: str) -> str:
    """Return a parameter of the command as messages name it, without its value."""
    return _LABELS.get(name, f"--{name}").removesuffix(" {}")


def _check_width(width: int) -> None:
    """Raise a UsageError for a width that no animation has."""
    from kinfmu.draw.animation import LARGEST, NARROWEST

    if not NARROWEST <= width <= LARGEST:
        raise click.UsageError(f"--width {width}: must be {NARROWEST} to {LARGEST} pixels")


def _others_than(*valid: str) -> list[str]:
    """Return the parameters that the command line gives, without the valid ones."""
    return [name for name, value in click.get_current_context().params.items() if value and name not in valid]


def _check_options_of_cam(joint: str) -> None:
    """Raise a UsageError for options that do not belong to the profile of a cam."""
    of_table = ("degrees", "lengths", "units", "separator", "decimal")
    others = _others_than("run", "output", "cam", "tolerance", "settings", *of_table)
    if others:
        raise click.UsageError(f"--cam {joint} excludes {listed(map(_label, others))}")


def _refuse_other_formats(suffix: str, options: Options) -> None:
    """Raise a UsageError for options that belong to other formats than that of a suffix, or exclude each other."""
    refused: dict[tuple[Format, ...], list[str]] = {}
    for name in _LABELS:
        takers = [kind for kind in KINDS if name in (*kind.options, *kind.also)]
        if options[name] not in (None, False) and not any(suffix in kind.suffixes for kind in takers):
            refused.setdefault(tuple(kind for kind in KINDS if name in kind.options), []).append(name)
    for kinds, names in refused.items():
        shown = listed(_LABELS[name].format(options[name]) for name in names)
        title = " and ".join(kind.name for kind in kinds)
        valid = listed(filter(None, [title, *(one for kind in kinds for one in kind.suffixes)]))
        others = [(name, kind.name) for name in names for kind in KINDS if name in kind.also]
        also = "".join(f"; {_label(name)} also for {kind_name}" for name, kind_name in others)
        raise click.UsageError(f"{shown}: only for {valid}, not {suffix}{also}")
    if options["svaj"]:
        excluded = [name for name in PLOTS.options if name not in ("svaj", "degrees") and options[name]]
        if excluded:
            raise click.UsageError(f"--svaj excludes {listed(map(_label, excluded))}")


def _write_page(shown: str, output: Path, settings: tuple[tuple[str, str], ...], options: Options) -> None:
    """Write the page of a record, from start to stop, or of a mechanism."""
    is_record = suffix_of(shown) == RECORD
    taken = ("start", "stop") if is_record else ("settings",)
    if suffix_of(output) not in PAGES or _others_than("run", "output", *taken):
        only = f"no other options than {'--start and --stop' if is_record else '--set'}"
        raise click.UsageError(
            f"{shown}: of a mechanism only a page (.html) is written, or with --cam a cam; a page has {only}; a "
            f"table, plot or animation needs a record (.mcap){_record_command(shown)}"
        )
    if is_record:
        from kinfmu.log import read

        run = samples_between(read(Path(shown)), options["start"], options["stop"])
        write_page(mechanism_of(run), output, run)
    else:
        mechanism = checked_settings(gallery.load(shown), settings).mechanism()
        with errors_of(shown):
            write_page(mechanism, output)


def _record_command(mechanism: str) -> str:
    """Return the command that makes a record of a mechanism, to follow 'a record (.mcap)'; '' for a record."""
    if suffix_of(mechanism) == RECORD:
        return ""
    name = mechanism.replace(":", "_") if gallery.has(mechanism) else mechanism
    return f": kinfmu solve {quote(mechanism)} -o {quote(str(Path(name).with_suffix(RECORD)))}"
