"""kinfmu export: write a run as a table, plot, animation or page; the file's ending chooses which."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import click

from kinfmu.cli.arguments import STANDARD_OUTPUT, InputFile, OutputFile, RecordOrMechanism, names_in, on_axis
from kinfmu.cli.export_formats import PAGES, export_cam, mechanism_of, write_page
from kinfmu.cli.group import errors_of, main
from kinfmu.cli.settings import checked_settings, csv_form, set_option, table_options
from kinfmu.errors import RequestError, listed
from kinfmu.files import suffix_of
from kinfmu.mechanism import gallery

if TYPE_CHECKING:
    from kinfmu.run import Run


TABLES, PLOTS, ANIMATIONS = (".csv", ".parquet", ".npz"), (".svg", ".png", ".pdf"), (".gif", ".mp4")
DRAWING = ".dxf"
FORMATS = (*TABLES, *PLOTS, *ANIMATIONS, DRAWING)


def _write(run: Run, path: Path, columns: Sequence[str], *, width: int | None, **how: Any) -> None:
    """Write a run in the format of the path's suffix."""
    if suffix_of(path) in TABLES:
        from kinfmu.log import write_table

        write_table(run, path, columns or None, **how)
    elif suffix_of(path) in PLOTS:
        from kinfmu.draw import plot

        plot(run, path, columns, **how)
    else:
        from kinfmu.draw import animate

        animate(run, path, width=width)


def _write_svaj(run: Run, output: Path, name: str, *, degrees: bool, **form: Any) -> None:
    """Write displacement, velocity, acceleration and jerk as a table."""
    from kinfmu.log.table import write_columns
    from kinfmu.motion.svaj_table import svaj_columns
    from kinfmu.run.tables import csv_lines

    columns = svaj_columns(run, name, degrees=degrees)
    if output == STANDARD_OUTPUT:
        for line in csv_lines(columns, **form):
            click.echo(line, nl=False)
        return
    write_columns(run, columns, output, **form)
    click.echo(f"written: {output}")


def _between(run: Run, start: str | None, stop: str | None) -> Run:
    """Return the samples from start to stop on the axis of the run, both included; all by default."""
    if start is None and stop is None:
        return run
    import numpy as np

    from kinfmu.run.axis import axis_of

    axis = axis_of(run)

    def end(option: str, text: str | None, default: float) -> float:
        if text is None:
            return default
        return on_axis(option, text, axis.label, axis.unit, f", {axis.range()}") / axis.factor

    first, last = end("--start", start, -math.inf), end("--stop", stop, math.inf)
    edge = 0.0
    if len(run) and not axis.is_time:  # driver values are rounded: 30 deg in radians, and back
        edge = 1e-9 * max(abs(axis.values[0]), abs(axis.values[-1]))
    rows = (axis.values >= first - edge) & (axis.values <= last + edge)
    if not rows.any():
        unit = f" {axis.unit}".rstrip()
        asked = f"from {first:g} to {last:g}{unit}"
        if stop is None:
            asked = f"from {first:g}{unit} on"
        elif start is None:
            asked = f"up to {last:g}{unit}"
        available = axis.range() or "none"
        raise RequestError(f"--start, --stop: the run has no samples {asked}; its samples: {available}")
    kept = run.t[rows]
    low, high = (first, last) if axis.is_time else (np.min(kept), np.max(kept))
    return run.part(rows, events=tuple(event for event in run.events if low <= event.t <= high))


def _check_width(width: int) -> None:
    """Raise a UsageError for a width that no animation has."""
    from kinfmu.draw.animation import LARGEST, NARROWEST

    if not NARROWEST <= width <= LARGEST:
        raise click.UsageError(f"--width {width}: must be {NARROWEST} to {LARGEST} pixels")


def _on_axis_of(run: Run, text: str) -> float:
    """Return a value of --at, in the unit of the axis of the run."""
    from kinfmu.run.axis import axis_of

    axis = axis_of(run)
    return on_axis("--at", text, axis.label, axis.unit, f", {axis.range()}") / axis.factor


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
    "solver.margin, -error. A table always contains time and status. Default: all columns; for plots angles, "
    "points of interest (if there are none, all coordinates), efforts and energies.",
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
    "--degrees",
    is_flag=True,
    help="Angles in deg, and their rates in time: in tables, and in plots, where driver values and those of --x always "
    "are.",
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
def export(
    run: str,
    other: Path | None,
    output: Path,
    columns: str | None,
    across: str | None,
    overlay: bool,
    polar: bool,
    svaj: str | None,
    degrees: bool,
    start: str | None,
    stop: str | None,
    at: str | None,
    width: int | None,
    cam: str | None,
    tolerance: str | None,
    units: bool,
    separator: str | None,
    decimal: str | None,
    settings: tuple[tuple[str, str], ...],
) -> None:
    """Write a run as a table, as plots, as an animation or as a page; or a mechanism as a page.

    A page (.html) is the mechanism, to be dragged in a browser, with the parameters and the time of the run; it is one
    file, works offline, and computes with the compiled code of the FMU.

    RUN is a record (.mcap) of simulate or solve. Tables in Parquet and npz contain the units. Plots (.svg, .png, .pdf)
    show coordinates, velocities and accelerations against time, or against the driver of a solve --angle. With --x,
    --overlay or --polar, exactly the named columns are curves. OTHER is a second run for the same plot. A .gif or
    .mp4 shows the moving linkage, a .dxf the pose at a value as a CAD drawing. With --cam, a mechanism or a record
    gives the profile of a cam as .csv, .dxf or a figure. --set is for mechanisms: a record has the values of its run.
    """
    if settings and suffix_of(run) == ".mcap":
        raise click.UsageError(
            f"--set {settings[0][0]}: only for mechanisms; {run} has the values of its run: use solve --set or "
            "simulate --set"
        )
    if width is not None:
        _check_width(width)
    if cam is not None:
        given: dict[str, Any] = {"units": units, "separator": separator, "decimal": decimal}
        export_cam(run, output, cam, tolerance, settings, degrees=degrees, **given)
        return
    if tolerance is not None:
        raise click.UsageError(f"--tolerance {tolerance}: only for the .dxf of a cam, with --cam")
    if suffix_of(output) in PAGES or suffix_of(run) != ".mcap":
        _export_page(run, output, start, stop, settings)
        return
    from kinfmu.log import read
    from kinfmu.log.table import columns_of
    from kinfmu.run.tables import csv_lines

    suffix = ".csv" if output == STANDARD_OUTPUT else suffix_of(output)
    form = csv_form(suffix, TABLES, units=units, separator=separator, decimal=decimal)
    plot_only = {
        "--x": across,
        "--overlay": overlay,
        "--polar": polar,
        "a second run": other,
    }
    if suffix not in TABLES:
        plot_only |= {"--svaj": svaj, "--degrees": degrees}
    asked = [name for name, value in plot_only.items() if value]
    if asked and suffix not in PLOTS:
        also = "".join(f"; {name} also for tables" for name in asked if name in ("--svaj", "--degrees"))
        raise click.UsageError(f"{listed(asked)}: only for plots, {listed(PLOTS)}, not {suffix}{also}")
    excluded = [name for name in asked if name not in ("--svaj", "--degrees")] + ["--columns"] * (columns is not None)
    if svaj and excluded:
        raise click.UsageError(f"--svaj excludes {listed(excluded)}")
    if at is not None and suffix != DRAWING:
        raise click.UsageError(f"--at {at}: only for {DRAWING}, not {suffix}")
    if width is not None and suffix not in ANIMATIONS:
        raise click.UsageError(f"--width {width}: only for animations, {listed(ANIMATIONS)}, not {suffix}")
    if columns is not None and suffix in (*ANIMATIONS, DRAWING):
        valid = listed((*TABLES, *PLOTS))
        raise click.UsageError(f"--columns {columns}: only for tables and plots, {valid}, not {suffix}")
    part = _between(read(Path(run)), start, stop)
    if svaj and suffix in TABLES:
        _write_svaj(part, output, svaj, degrees=degrees, **form)
        return
    if output == STANDARD_OUTPUT:
        for line in csv_lines(columns_of(part, names_in(columns), degrees=degrees), **form):
            click.echo(line, nl=False)
        return
    if suffix == DRAWING:
        from kinfmu.draw import dxf

        dxf(part, output, None if at is None else _on_axis_of(part, at))
        click.echo(f"written: {output}")
        return
    if svaj:
        from kinfmu.draw import svaj as drawn

        drawn(part, output, svaj, degrees=degrees)
        click.echo(f"written: {output}")
        return
    how: dict[str, Any] = {"degrees": degrees}
    how |= form if suffix in TABLES else {"x": names_in(across) or (), "overlaid": overlay, "polar": polar}
    if other is not None:
        how |= {"other": _between(read(other), start, stop), "names": (Path(run).stem, other.stem)}
    _write(part, output, names_in(columns) or (), width=width, **how)
    click.echo(f"written: {output}")


def _record_command(mechanism: str) -> str:
    """Return the command that makes a record of a mechanism, to follow 'a record (.mcap)'; '' for a record."""
    if suffix_of(mechanism) == ".mcap":
        return ""
    name = mechanism.replace(":", "_") if gallery.has(mechanism) else mechanism
    return f": kinfmu solve {quote(mechanism)} -o {quote(str(Path(name).with_suffix('.mcap')))}"


def _export_page(
    given: str, output: Path, start: str | None, stop: str | None, settings: Sequence[tuple[str, str]]
) -> None:
    """Write the page of a record, from start to stop, or of a mechanism."""
    is_record = suffix_of(given) == ".mcap"
    valid = {"run", "output", *(("start", "stop") if is_record else ("settings",))}
    others = [name for name, value in click.get_current_context().params.items() if value and name not in valid]
    if others or suffix_of(output) not in PAGES:
        options = f"no other options than {'--start and --stop' if is_record else '--set'}"
        raise click.UsageError(
            f"{given}: of a mechanism only a page (.html) is written, or with --cam a cam; a page has {options}; a "
            f"table, plot or animation needs a record (.mcap){_record_command(given)}"
        )
    if is_record:
        from kinfmu.log import read

        run = _between(read(Path(given)), start, stop)
        write_page(mechanism_of(run), output, run)
    else:
        mechanism = checked_settings(gallery.load(given), settings).mechanism()
        with errors_of(given):
            write_page(mechanism, output)
    click.echo(f"written: {output}")
