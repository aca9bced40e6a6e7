"""What `kinfmu export` writes: one writer for each format, with the options of the command that belong to it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kinfmu.cli.arguments import STANDARD_OUTPUT, driver_value, names_in, on_axis
from kinfmu.cli.group import errors_of, patience
from kinfmu.cli.settings import CSV, XLSX, checked_settings, csv_form, has_degrees
from kinfmu.errors import KinfmuError, RequestError, listed
from kinfmu.files import errors_of_writing, suffix_of, write_whole
from kinfmu.mechanism import gallery
from kinfmu.units import Quantity

if TYPE_CHECKING:
    from kinfmu.mechanism import Mechanism
    from kinfmu.run import Run

Options = Mapping[str, Any]  # of the command, by the names of its parameters; `form` of a CSV file, `run`: as given
PAGES = (".html",)
CAM_FORMATS = (CSV, XLSX, ".dxf", ".svg", ".png", ".pdf")
_FINE = 1e-5  # of the largest distance of the profile from the axle


def write_table(run: Run, output: Path, options: Options) -> None:
    """Write columns of a run, or displacement, velocity, acceleration and jerk, as a table."""
    from kinfmu.log.table import columns_of, write_columns
    from kinfmu.log.table import write_table as written
    from kinfmu.motion.motion_curve import svaj_columns
    from kinfmu.run.tables import csv_lines, in_lengths

    names, form, lengths = names_in(options["columns"]), options["form"], options["lengths"]
    degrees, svaj = has_degrees(suffix_of(output), options), options["svaj"]
    columns = (
        [in_lengths(one, run.length_unit, lengths) for one in svaj_columns(run, svaj, degrees=degrees)]
        if svaj
        else None
    )
    if output == STANDARD_OUTPUT:
        _print(csv_lines(columns or columns_of(run, names, degrees=degrees, lengths=lengths), **form))
    elif columns:
        write_columns(run, columns, output, **form)
    else:
        written(run, output, names, degrees=degrees, lengths=lengths, **form)


def write_plot(run: Run, output: Path, options: Options) -> None:
    """Plot columns of a run, also of a second one, or displacement, velocity, acceleration and jerk."""
    from kinfmu.draw import plot, svaj
    from kinfmu.log import read

    degrees, other = options["degrees"], options["other"]
    if options["svaj"]:
        svaj(run, output, options["svaj"], degrees=bool(degrees))
        return
    how: dict[str, Any] = {"x": names_in(options["across"]) or (), "overlaid": options["overlay"]}
    if other is not None:
        second = samples_between(read(other), options["start"], options["stop"])
        how |= {"other": second, "names": (Path(options["run"]).stem, other.stem)}
    plot(run, output, names_in(options["columns"]) or (), degrees=degrees, polar=options["polar"], **how)


def write_animation(run: Run, output: Path, options: Options) -> None:
    """Write the moving linkage."""
    from kinfmu.draw import animate

    animate(run, output, width=options["width"])


def write_drawing(run: Run, output: Path, options: Options) -> None:
    """Write the pose at a value as a CAD drawing."""
    from kinfmu.draw import dxf

    at = options["at"]
    dxf(run, output, None if at is None else _place(run, "--at", at))


def _print(lines: Iterable[str]) -> None:
    for line in lines:
        click.echo(line, nl=False)


def _place(run: Run, option: str, text: str) -> float:
    """Return a position on the axis of a run, in its unit, from the text of an option."""
    from kinfmu.run.axis import axis_of

    axis = axis_of(run)
    return on_axis(option, text, axis.label, axis.unit, f", {axis.range()}") / axis.factor


def samples_between(run: Run, start: str | None, stop: str | None) -> Run:
    """Return the samples from `start` to `stop` on the axis of the run, both included; all by default."""
    if start is None and stop is None:
        return run
    import numpy as np

    from kinfmu.run.axis import axis_of

    axis = axis_of(run)
    first = -math.inf if start is None else _place(run, "--start", start)
    last = math.inf if stop is None else _place(run, "--stop", stop)
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
    times = run.t[rows]
    low, high = (first, last) if axis.is_time else (np.min(times), np.max(times))
    return run.part(rows, events=tuple(event for event in run.events if low <= event.t <= high))


def write_cam(shown: str, output: Path, joint: str, settings: Sequence[tuple[str, str]], options: Options) -> str:
    """Write the profile of a cam of a mechanism, or of the mechanism of a record; return the end of the message."""
    suffix = ".csv" if output == STANDARD_OUTPUT else suffix_of(output)
    if suffix not in CAM_FORMATS:
        raise click.UsageError(f"{output}: the profile of a cam is written as {listed(CAM_FORMATS)}")
    is_table = suffix in (CSV, XLSX)
    form, degrees, tolerance = (
        csv_form(suffix, (CSV, XLSX), options),
        has_degrees(suffix, options),
        options["tolerance"],
    )
    if degrees and not is_table:
        about = "its figure has angles in deg" if suffix != ".dxf" else "a drawing has no angles"
        raise click.UsageError(f"--degrees: of a cam only for {CSV}, {XLSX}, not {suffix}; {about}")
    if tolerance is not None and suffix != ".dxf":
        raise click.UsageError(f"--tolerance {tolerance}: only for .dxf, not {suffix}")
    from kinfmu.analysis import cam_profile

    if suffix_of(shown) == ".mcap":
        from kinfmu.log import read

        mechanism = mechanism_of(read(Path(shown)))
    else:
        mechanism = checked_settings(gallery.load(shown), settings).mechanism()
    unit = mechanism.length_unit
    within = None if tolerance is None else driver_value("--tolerance", tolerance, Quantity("length"), unit)
    if within is not None and not within > 0.0:
        raise click.UsageError(f"--tolerance {tolerance}: must be a positive length, such as 0.01{unit}")
    with errors_of(shown):
        try:
            profile = cam_profile(mechanism, joint)
        except RequestError as error:
            raise RequestError(f"--cam: {error}") from None
        about = ""
        if suffix == ".dxf":
            import numpy as np

            within = within or _FINE * float(np.hypot(*(profile.profile - profile.axle).T).max())
            profile = cam_profile(mechanism, joint, tolerance=within)
            about = f" ({len(profile.angle)} corners, within {within:.3g} {unit} of the curve)"
    if is_table:
        from kinfmu.log.table import write_sheet
        from kinfmu.run.tables import Column, csv_lines, in_lengths

        columns = [
            in_lengths(Column(name, own, values + 0.0), unit, options["lengths"])
            for name, own, values in profile.columns(degrees=degrees)
        ]
        if output == STANDARD_OUTPUT:
            _print(csv_lines(columns, **form))
        else:
            write_sheet(columns, output, **form)
    else:
        from kinfmu.draw import cam

        cam(profile, output)
    return about


def write_page(mechanism: Mechanism, path: Path, run: Run | None = None) -> None:
    """Write the page of a mechanism, or of a run of it, whose motion the page shows.

    Raises:
        KinfmuError: There is no page, or it cannot be written.

    """
    from kinfmu.page import page
    from kinfmu.page.samples import samples_of

    over = driver_of(run) if run else None
    samples = samples_of(run, mechanism) if run and not over else None
    with patience():
        text = page(mechanism, over=over, samples=samples)
    with errors_of_writing(path, KinfmuError):
        write_whole(path, text.encode())


def mechanism_of(run: Run) -> Mechanism:
    """Return the mechanism of a run: with its parameters, and the time from its first to its last sample."""
    from kinfmu.run.axis import axis_of

    mechanism = run.mechanism
    if mechanism is None:
        raise KinfmuError("the run does not hold its mechanism; give the mechanism file in its place")
    if not axis_of(run).is_time or len(run) < 2:
        return mechanism
    return replace(mechanism, run=replace(mechanism.run, start=float(run.t[0]), stop=float(run.t[-1])))


def driver_of(run: Run) -> tuple[str, float, float] | None:
    """Return the driver on the axis of a run, with its first and last value; None if there is none."""
    from kinfmu.run.axis import axis_of

    axis = axis_of(run)
    if axis.is_time or run.mechanism is None or len(run.mechanism.drivers) != 1 or len(run) < 2:
        return None
    values = run.inputs[:, 0]
    if axis.name != run.mechanism.drivers[0].name or values[0] == values[-1]:
        return None
    return axis.name, float(values[0]), float(values[-1])
