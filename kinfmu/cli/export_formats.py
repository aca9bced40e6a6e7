"""What export writes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kinfmu.cli.arguments import STANDARD_OUTPUT, driver_value
from kinfmu.cli.group import errors_of, patience
from kinfmu.cli.settings import checked_settings, csv_form
from kinfmu.errors import KinfmuError, RequestError, listed
from kinfmu.files import suffix_of, write_whole
from kinfmu.mechanism import gallery
from kinfmu.units import Quantity

if TYPE_CHECKING:
    from kinfmu.mechanism import Mechanism
    from kinfmu.run import Run


FORMATS = (".csv", ".dxf", ".svg", ".png", ".pdf")
_FINE = 1e-5  # of the largest distance of the profile from the axle


def export_cam(
    given: str,
    output: Path,
    joint: str,
    tolerance: str | None,
    settings: Sequence[tuple[str, str]],
    *,
    degrees: bool,
    **form: Any,
) -> None:
    """Write the profile of a cam of a mechanism, or of the mechanism of a record; form: as `csv_form` takes it."""
    valid = {"run", "output", "cam", "tolerance", "settings", "degrees", *form}
    others = [name for name, value in click.get_current_context().params.items() if value and name not in valid]
    if others:
        options = listed(f"--{name}" for name in others).replace("--other", "a second run").replace("across", "x")
        raise click.UsageError(f"--cam {joint} excludes {options}")
    suffix = ".csv" if output == STANDARD_OUTPUT else suffix_of(output)
    if suffix not in FORMATS:
        raise click.UsageError(f"{output}: the profile of a cam is written as {listed(FORMATS)}")
    form = csv_form(suffix, (".csv",), **form)
    if degrees and suffix != ".csv":
        about = "its figure has angles in deg" if suffix != ".dxf" else "a drawing has no angles"
        raise click.UsageError(f"--degrees: of a cam only for .csv, not {suffix}; {about}")
    if tolerance is not None and suffix != ".dxf":
        raise click.UsageError(f"--tolerance {tolerance}: only for .dxf, not {suffix}")
    from kinfmu.analysis import cam_profile

    if suffix_of(given) == ".mcap":
        from kinfmu.log import read

        mechanism = mechanism_of(read(Path(given)))
    else:
        mechanism = checked_settings(gallery.load(given), settings).mechanism()
    unit = mechanism.length_unit
    within = None if tolerance is None else driver_value("--tolerance", tolerance, Quantity("length"), unit)
    if within is not None and not within > 0.0:
        raise click.UsageError(f"--tolerance {tolerance}: must be a positive length, such as 0.01{unit}")
    with errors_of(given):
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
    if output == STANDARD_OUTPUT:
        for line in profile.csv_lines(degrees=degrees, **form):
            click.echo(line, nl=False)
        return
    if suffix == ".csv":
        profile.write_csv(output, degrees=degrees, **form)
    else:
        from kinfmu.draw import cam

        cam(profile, output)
    click.echo(f"written: {output}{about}")


PAGES = (".html",)


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
    try:
        write_whole(path, text.encode())
    except OSError as error:
        raise KinfmuError(f"{path}: cannot be written ({error.strerror})") from None


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
