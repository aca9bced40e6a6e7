"""The command line: kinfmu list | new | schema | check | solve | build | simulate | review."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kinfmu import VERSION, gallery
from kinfmu.errors import AssemblyError, KinfmuError, MechanismError, listed, suggestion
from kinfmu.units import Quantity, factors

if TYPE_CHECKING:
    from kinfmu.analysis import Assemblies, Report
    from kinfmu.mechanism import Mechanism
    from kinfmu.run import Run

LONG_RUN = 2000  # samples from which a progress bar is worth a line
TABLES = (".csv", ".parquet", ".npz")
FIGURES = (".svg", ".png")


class _MechanismName(click.ParamType):  # type: ignore[type-arg,unused-ignore]  # generic in newer clicks only
    """A gallery name or a .toml file; what does not exist is wrong usage, what is wrong in it the mechanism's fault."""

    name = "MECH"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        known = gallery.names()
        if gallery.has(str(value)) or (str(value).endswith(".toml") and _exists(Path(value))):
            return str(value)
        if str(value).endswith(".toml"):
            self.fail(f"{value}: there is no such file", param, ctx)
        hint = suggestion(str(value), known)
        message = f"'{value}' is not in the gallery{hint}; gallery: {listed(known)}; files end in .toml"
        return self.fail(message, param, ctx)


def _exists(path: Path) -> bool:
    """True if something other than a folder is there; a name that no file can have is not there."""
    try:
        return path.exists() and not path.is_dir()
    except (OSError, ValueError):
        return False


class _Setting(click.ParamType):  # type: ignore[type-arg,unused-ignore]  # generic in newer clicks only
    """NAME=VALUE."""

    name = "NAME=VALUE"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, str]:
        if isinstance(value, tuple):
            return value
        name, equals, text = str(value).partition("=")
        if not (name and equals and text):
            self.fail(f"'{value}' must be NAME=VALUE, such as crank.speed=2.0", param, ctx)
        return name, text


class _Range(click.ParamType):  # type: ignore[type-arg,unused-ignore]  # generic in newer clicks only
    """A:B:X of numbers, with units where the quantity has any."""

    def __init__(self, quantity: Quantity, last: str) -> None:
        self.quantity = quantity
        self.last = last
        self.name = f"A:B:{last}"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float, float]:
        if isinstance(value, tuple):
            return value
        parts = str(value).split(":")
        if len(parts) != 3:
            example = "0deg:360deg:361" if self.last == "N" else "0:1.5:0.01"
            self.fail(f"'{value}' must be {self.name}, such as {example}", param, ctx)
        third = Quantity("number") if self.last == "N" else self.quantity
        try:
            numbers = [
                _number(part, quantity)
                for part, quantity in zip(parts, (self.quantity, self.quantity, third), strict=True)
            ]
        except ValueError as error:
            return self.fail(str(error), param, ctx)
        a, b, x = numbers
        if self.last == "N" and (x != int(x) or x < 1):
            self.fail(f"'{value}': N = {parts[2]} must be a whole number of samples", param, ctx)
        if self.last == "STEP" and (x <= 0.0 or b < a):
            self.fail(f"'{value}' must run forwards with a positive step", param, ctx)
        from kinfmu.run import MOST_SAMPLES

        if (x if self.last == "N" else (b - a) / x) > MOST_SAMPLES:
            self.fail(f"'{value}' asks for more than {MOST_SAMPLES} samples", param, ctx)
        return a, b, x


def _number(text: str, quantity: Quantity) -> float:
    """'360deg' as radians, '1.5' as it is; ValueError says what would be valid."""
    known = factors(quantity, "m") if quantity.kind != "length" else {}
    for unit in sorted(known, key=len, reverse=True):
        if text.endswith(unit) and text[: -len(unit)].strip():
            text, factor = text[: -len(unit)], known[unit]
            break
    else:
        factor = 1.0
    try:
        number = float(text) * factor
    except ValueError:
        raise ValueError(f"'{text}' is not a number{f' (units: {listed(known)})' if known else ''}") from None
    if not math.isfinite(number):
        raise ValueError(f"'{text}' is not a finite number")
    return number


MECHANISM = _MechanismName()
SETTING = _Setting()


class _Group(click.Group):
    """Turns what kinfmu raises on purpose into one line on stderr and exit status 1."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except KinfmuError as error:
            click.echo("kinfmu: " + " ".join(str(error).splitlines()), err=True)
            ctx.exit(1)
        except MemoryError:
            click.echo("kinfmu: there is not enough memory for so large a mechanism", err=True)
            ctx.exit(1)


@contextmanager
def _about(mechanism: str) -> Iterator[None]:
    """What is found wrong in a mechanism after its file was read is told with the file's name in front."""
    try:
        yield
    except (MechanismError, AssemblyError) as error:
        raise type(error)(f"{mechanism}: {error}", **error.data) from None


@contextmanager
def _instead(path: str, name: str) -> Iterator[None]:
    """What is found wrong is told of what the user named, not of a file made on the way."""
    try:
        yield
    except KinfmuError as error:
        raise type(error)(str(error).replace(path, name), **error.data) from None


@click.group(cls=_Group, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(VERSION, prog_name="kinfmu")
def main() -> None:
    """Planar kinematics: from a mechanism file to an FMU and logs that can be reviewed.

    MECH is a name of the gallery (kinfmu list) or a .toml file. Exit status: 0 fine, 1 the mechanism or the run is at
    fault, 2 wrong usage.
    """


@main.command("list")
def list_() -> None:
    """The mechanisms of the gallery."""
    names = gallery.names()
    width = max(map(len, names), default=0)
    for name in names:
        click.echo(f"{name:{width}}  {gallery.load(name).title}")


@main.command()
@click.argument("mechanism", metavar="MECH")
@click.argument("file", type=click.Path(dir_okay=False, path_type=Path))
def new(mechanism: str, file: Path) -> None:
    """Write a commented starting FILE, from gallery mechanism MECH."""
    if file.suffix != ".toml":
        raise click.UsageError(f"{file}: a mechanism file ends in .toml")
    if _exists(file):
        raise KinfmuError(f"{file}: is there already; nothing was written")
    name = MECHANISM.convert(mechanism, None, None)
    source = gallery.folder() / name / "mechanism.toml" if name in gallery.names() else Path(name)
    try:
        if ":" in name and gallery.has(name):  # a chain, which no file holds
            gallery.save(gallery.load(name), file)
        else:
            file.write_bytes(source.read_bytes())
    except OSError as error:
        raise KinfmuError(f"{file}: cannot be written ({error.strerror})") from None
    click.echo(f"{file}: written; next: kinfmu check {file}")


@main.command()
@click.option("-o", "output", type=click.Path(dir_okay=False, path_type=Path), help="Where to; stdout if not said.")
def schema(output: Path | None) -> None:
    """The JSON Schema of mechanism files, by which editors complete and check them."""
    from kinfmu.mechanism.schema import schema_text

    if output is None:
        click.echo(schema_text(), nl=False)
        return
    try:
        output.write_text(schema_text(), encoding="utf-8", newline="\n")
    except OSError as error:
        raise KinfmuError(f"{output}: cannot be written ({error.strerror})") from None
    click.echo(f"{output}: written; a mechanism file names it in its first line: #:schema {output}")


@main.command()
@click.argument("mechanism", type=MECHANISM, metavar="MECH")
@click.option("--json", "as_json", is_flag=True, help="Findings for programs.")
@click.option("--matrices", is_flag=True, help="Jacobians at the start pose and singular points.")
@click.option("--assemblies", is_flag=True, help="The ways of putting it together, and how to choose one.")
@click.option(
    "--figure",
    "picture",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Draw the mechanism with names: .svg or .png.",
)
@click.option("--set", "settings", type=SETTING, multiple=True, help="A parameter, such as crank=40mm.")
def check(
    mechanism: str,
    as_json: bool,
    matrices: bool,
    assemblies: bool,
    picture: Path | None,
    settings: tuple[tuple[str, str], ...],
) -> None:
    """Mobility, redundant and contradicting constraints, drivers, plan, ranges and singular points."""
    from kinfmu.analysis import check as checked

    if picture is not None and picture.suffix.lower() not in FIGURES:
        raise click.UsageError(f"--figure {picture}: a figure ends in one of {listed(FIGURES)}")
    mech = _with_parameters(mechanism, settings)
    with _about(mechanism):
        report = checked(mech)
    if as_json:
        findings = report.as_json()
        if matrices and report.problem is None:
            findings["matrices"] = [matrix.as_json() for matrix in report.matrices()]
        if assemblies:
            found = _assemblies(report)
            findings["assemblies"] = None if found is None else found.as_json()
        click.echo(json.dumps(findings, indent=2))
    else:
        click.echo(str(report))
        if assemblies and (found := _assemblies(report)) is not None:
            click.echo(str(found))
        if matrices and report.problem is None:
            for matrix in report.matrices():
                click.echo(f"\n{matrix}")
    with _about(mechanism):
        if picture is not None:
            from kinfmu.draw import figure

            figure(mech, picture)
            if not as_json:
                click.echo(f"  figure      {picture}")
        if report.problem is not None:
            raise report.problem


@main.command()
@click.argument("mechanism", type=MECHANISM, metavar="MECH")
@click.option(
    "-o", "output", type=click.Path(dir_okay=False, path_type=Path), required=True, help=".csv, .parquet or .npz."
)
@click.option("--times", type=_Range(Quantity("time"), "STEP"), help="Times [s]; the file's run if nothing is said.")
@click.option(
    "--angle",
    type=_Range(Quantity("angle"), "N"),
    help="N values of the driver [rad], or such as 0deg:360deg:361; rates are for 1 rad/s, time counts the samples.",
)
@click.option(
    "--set", "settings", type=SETTING, multiple=True, help="A parameter or law constant, such as crank.speed=2.0."
)
@click.option("--outputs", help="Names to solve for, with commas; all if nothing is said.")
@click.option("--engine", type=click.Choice(["auto", "python"]), default="auto", show_default=True)
def solve(
    mechanism: str,
    output: Path,
    times: tuple[float, float, float] | None,
    angle: tuple[float, float, float] | None,
    settings: tuple[tuple[str, str], ...],
    outputs: str | None,
    engine: str,
) -> None:
    """Solve position, velocity and acceleration at times or at driver values, into a table."""
    import numpy as np

    from kinfmu.log import write_table
    from kinfmu.mechanism import RunSettings
    from kinfmu.sweep import run_times
    from kinfmu.sweep import solve as solved

    if output.suffix.lower() not in TABLES:
        raise click.UsageError(f"-o {output}: a table ends in one of {listed(TABLES)}")
    if times and angle:
        raise click.UsageError("--times and --angle cannot both drive")
    mech = gallery.load(mechanism)
    wanted = [name.strip() for name in outputs.split(",")] if outputs else None
    geometry: dict[str, float | str] = {name: text for name, text in settings if name in mech.parameters}
    laws = _parameters(tuple(setting for setting in settings if setting[0] not in geometry))
    for name, value in laws.items():
        if isinstance(value, bool):
            raise click.UsageError(f"--set {name}: a law constant is a number")
    if angle:
        if len(mech.drivers) != 1:
            raise click.UsageError(f"--angle drives one driver; this mechanism has {len(mech.drivers)}")
        t = None
        for name in laws:
            raise click.UsageError(f"--set {name} changes the law, which --angle does not use")
        samples: dict[str, Any] = {mech.drivers[0].inputs()[0]: np.linspace(angle[0], angle[1], int(angle[2]))}
    else:
        t, samples = (run_times(RunSettings(*times)) if times else None), {}
    with _about(mechanism):
        run = solved(mech, t, parameters=geometry | laws, outputs=wanted, engine=engine, **samples)
    write_table(run, output)
    click.echo(f"{verdict(run)}; written to {output}")
    _fail_if_failed(run)


@main.command()
@click.argument("mechanism", type=MECHANISM, metavar="MECH")
@click.option("-o", "output", type=click.Path(path_type=Path), help="Where to; <name>.fmu if nothing is said.")
@click.option(
    "--flavour", type=click.Choice(["python"]), default="python", show_default=True, help="What the FMU is made of."
)
@click.option(
    "--drive",
    type=click.Choice(["time", "inputs"]),
    help="What drives at first: the file's laws or the inputs; time, unless a law is external.",
)
@click.option("--outputs", help="Coordinates that the FMU shall have, with commas; all if nothing is said.")
@click.option("--set", "settings", type=SETTING, multiple=True, help="A parameter, such as crank=40mm.")
def build(
    mechanism: str,
    output: Path | None,
    flavour: str,
    drive: Any,
    outputs: str | None,
    settings: tuple[tuple[str, str], ...],
) -> None:
    """Build the FMU of a mechanism."""
    from kinfmu.fmu import build as built
    from kinfmu.fmu.build import default_drive

    mech = _with_parameters(mechanism, settings)
    drive = drive or default_drive(mech)
    wanted = [name.strip() for name in outputs.split(",")] if outputs else None
    with _about(mechanism):
        path = built(mech, output or _own_folder(mech), flavour=flavour, drive=drive, outputs=wanted)
    click.echo(f"{path}: {path.stat().st_size / 1000.0:.0f} kB, FMI 2.0 co-simulation, driven by {drive}")


@main.command()
@click.argument("model", metavar="FMU|MECH")
@click.option("--start", type=float, help="[s]; from the model if nothing is said, like stop and step.")
@click.option("--stop", type=float, help="[s]")
@click.option("--step", type=float, help="Communication step [s].")
@click.option(
    "--input",
    "inputs",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="CSV with time and inputs such as crank_angle.",
)
@click.option("--set", "settings", type=SETTING, multiple=True, help="A parameter, such as crank.speed=2.0.")
@click.option(
    "--mcap", type=click.Path(dir_okay=False, path_type=Path), help="Record; logs/<name>.mcap if nothing is said."
)
@click.option(
    "--rrd",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Rerun recording; logs/<name>.rrd if nothing is said.",
)
def simulate(
    model: str,
    start: float | None,
    stop: float | None,
    step: float | None,
    inputs: Path | None,
    settings: tuple[tuple[str, str], ...],
    mcap: Path | None,
    rrd: Path | None,
) -> None:
    """Step an FMU with fmpy (a mechanism is built first), and log the run to MCAP and Rerun."""
    from tempfile import TemporaryDirectory

    from kinfmu.fmu import build as built
    from kinfmu.fmu import simulate as simulated
    from kinfmu.log import write_mcap, write_rrd

    for path, suffix in ((mcap, ".mcap"), (rrd, ".rrd")):
        if path is not None and path.suffix.lower() != suffix:
            raise click.UsageError(f"--{suffix[1:]} {path}: such a file ends in {suffix}")
    with TemporaryDirectory(prefix="kinfmu_") as folder:
        fmu = Path(model)
        if fmu.suffix != ".fmu":
            mech = gallery.load(MECHANISM.convert(model, None, None))
            with _about(model):
                geometry = {name: text for name, text in settings if name in mech.parameters}
                changed = mech.with_parameters(geometry).parameters  # reads units
                settings = tuple(
                    (name, repr(float(changed[name].value)) if name in geometry else text) for name, text in settings
                )
                fmu = built(mech, Path(folder), drive="inputs" if inputs else "time")
        elif not _exists(fmu):
            raise click.UsageError(f"{fmu}: there is no such file")
        with _Progress() as progress, _instead(str(fmu), model):
            run = simulated(
                fmu,
                start=start,
                stop=stop,
                step=step,
                inputs=inputs,
                parameters=_parameters(settings),
                progress=progress,
            )
    name = run.info.get("name") or fmu.stem
    logs = Path("logs")
    if mcap is None or rrd is None:
        try:
            logs.mkdir(exist_ok=True)
        except OSError as error:
            raise KinfmuError(f"{logs}: cannot be made ({error.strerror})") from None
    record, recording = mcap or logs / f"{name}.mcap", rrd or logs / f"{name}.rrd"
    write_mcap(run, record)
    write_rrd(run, recording)
    click.echo(f"{verdict(run)}; written to {record} and {recording}")
    click.echo(f"to look at it: kinfmu review {record}")
    _fail_if_failed(run)


@main.command()
@click.argument("run", type=click.Path(dir_okay=False, path_type=Path))
@click.argument("other", required=False, type=click.Path(dir_okay=False, path_type=Path))
@click.option(
    "--save",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write the recording (.rrd) instead of opening the viewer.",
)
@click.option(
    "--screenshot",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Take a picture (.png) with a viewer that needs no screen.",
)
@click.option("--at", type=float, help="Time of the picture [s].")
def review(run: Path, other: Path | None, save: Path | None, screenshot: Path | None, at: float | None) -> None:
    """Open the Rerun viewer on RUN (.mcap), or on two runs compared."""
    from kinfmu.log import review as reviewed

    recording = reviewed(run, other, save=save, screenshot=screenshot, at=at)
    made = [str(path) for path in (recording, screenshot) if path is not None]
    click.echo(f"made {listed(made)}")


def _assemblies(report: Report) -> Assemblies | None:
    """The ways of putting a mechanism together; None where its problem, told at the end, leaves none."""
    try:
        return report.assemblies()
    except KinfmuError:
        if report.problem is None:
            raise
        return None


class _Progress:
    """A progress bar on stderr for long runs, where somebody sees it."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._done = 0

    def __enter__(self) -> Callable[[int, int], None]:
        return self._show

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.render_finish()

    def _show(self, done: int, count: int) -> None:
        if self._bar is None:
            if count < LONG_RUN or not sys.stderr.isatty():
                return
            self._bar = click.progressbar(length=count, label="simulating", file=sys.stderr)
            self._bar.render_progress()
        if done - self._done >= count // 200 or done == count:
            self._bar.update(done - self._done)
            self._done = done


def verdict(run: Run) -> str:
    """'181 samples: 175 ok, 6 bridged; largest residual 1.1e-16'."""
    from kinfmu.solver.status import Status

    counts = [(status, int((run.status == status).sum())) for status in Status]
    said = listed(f"{count} {status.name.lower().replace('_', ' ')}" for status, count in counts if count)
    residuals = run.residual[run.good]
    largest = f"; largest residual {residuals.max():.2g} of the size" if len(residuals) else ""
    return f"{len(run)} samples: {said}{largest}"


def _fail_if_failed(run: Run) -> None:
    for event in run.events:
        if event.level == "error":
            told = event.text.startswith("at t = ")  # an FMU says itself when
            raise KinfmuError(event.text if told else f"at t = {event.t:g} s: {event.text}")


def _parameters(settings: tuple[tuple[str, str], ...]) -> dict[str, float | bool]:
    """Settings as numbers, or true and false."""
    parameters: dict[str, float | bool] = {}
    for name, text in settings:
        if text.lower() in ("true", "false"):
            parameters[name] = text.lower() == "true"
            continue
        try:
            parameters[name] = float(text)
        except ValueError:
            raise click.UsageError(f"--set {name}={text}: '{text}' is not a number") from None
    return parameters


def _with_parameters(name: str, settings: tuple[tuple[str, str], ...]) -> Mechanism:
    """The mechanism of this name with parameters as set on the command line."""
    mechanism = gallery.load(name)
    for parameter, text in settings:
        if parameter not in mechanism.parameters:
            known = mechanism.parameters
            raise click.UsageError(
                f"--set {parameter}={text}: {name} has no parameter '{parameter}'{suggestion(parameter, known)}; "
                f"parameters: {listed(known)}"
            )
    with _about(name):
        return mechanism.with_parameters({parameter: _value(text) for parameter, text in settings})


def _value(text: str) -> float | str:
    """A number, or text that says its unit or its expression."""
    try:
        return float(text)
    except ValueError:
        return text


def _own_folder(mechanism: Mechanism) -> Path:
    """fmus/<name>/<name>.fmu where this is a checkout with that folder, else <name>.fmu here."""
    own = Path("fmus") / mechanism.name
    return (own if own.is_dir() else Path()) / f"{mechanism.name}.fmu"


if __name__ == "__main__":
    main()
