"""scripts/bench: run time against error; cost of a sample, a sweep, a step, a record, commands and chains."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from itertools import count
from pathlib import Path

import click

from kinfmu.cli.arguments import ArgumentType
from kinfmu.cli.group import ProgramOfOneCommand, Progress
from kinfmu.errors import MissingPackageError, listed, suggestion
from kinfmu.mechanism import gallery

TEXTS: dict[str, tuple[str, tuple[str, ...]]] = {  # module of benchmarks, and the mechanisms it measures
    "sample": ("solve_sample", ()),
    "sweep": ("native_sweep", ()),
    "designs": ("designs", ()),
    "forces": ("forces", ()),
    "step": ("fmu_step", ("fourbar",)),
    "native": ("native_step", ("fourbar",)),
    "jitter": ("jitter", ("fourbar",)),
    "log": ("log_files", ()),
    "commands": ("commands", ()),
    "chains": ("chains", ()),
    "size": ("sizes", ()),
}
WITH_CHARTS = ("accuracy", "size")
MEASUREMENTS = ("accuracy", *TEXTS)
ALL = "all"


class Named(ArgumentType):
    """One of a few names; the message for an unknown name suggests the nearest."""

    def __init__(self, name: str, what: str, known: Callable[[], list[str]]) -> None:
        self.name = name
        self.what = what
        self.known = known

    def read(self, text: str) -> str:
        known = self.known()
        if text not in known:
            raise ValueError(f"'{text}' is not {self.what}{suggestion(text, known)}; known: {listed(known)}")
        return text


def _with_reference() -> list[str]:
    """Return the mechanisms of the gallery that have a reference.csv."""
    return [name for name in gallery.names() if (gallery.folder() / name / "reference.csv").is_file()]


@click.command(
    cls=ProgramOfOneCommand,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Example: scripts/bench sample",
)
@click.argument("what", nargs=-1, type=Named("WHAT", "a measurement", lambda: [*MEASUREMENTS, ALL]))
@click.option(
    "--mechanism",
    "mechanisms",
    multiple=True,
    metavar="NAME",
    type=Named("NAME", "a mechanism of the gallery with a reference", _with_reference),
    help="For accuracy: a mechanism of the gallery. Repeat for several. Default: five.",
)
@click.option("--rounds", type=click.IntRange(1), help="Rounds of measurements; each round measures every engine once.")
@click.option(
    "-o",
    "folder",
    type=click.Path(file_okay=False, path_type=Path),
    help="Where accuracy and size write tables and charts. Default: docs/ of a checkout; the current folder without a "
    "checkout or with --mechanism.",
)
def main(what: tuple[str, ...], mechanisms: tuple[str, ...], rounds: int | None, folder: Path | None) -> None:
    """Measure kinfmu on this machine, compared with other solvers.

    WHAT is one or more of these. Default: accuracy.

    \b
    accuracy  run time against error of every engine in every setting, and through
              singular points: the tables and charts of docs/accuracy.md; takes minutes
    sample    a sample of solve, compared with the readable reference
    sweep     a sweep by the native engine, compared with a closed form and pylinkage
    designs   calls and batches with other lengths, compared with closed forms and scipy
    forces    efforts and reactions of a sweep, compared with the sweep alone
    step      a step of the FMU, compared with the smallest pythonfmu FMU
    native    a step of the native FMU in a C host, without efforts and with them
    jitter    the longest steps of the native FMU in a C host at 10 kHz; a round has 100,000
    log       writing and reading records of a million samples, compared with mcap
    commands  whole commands and `import kinfmu`, compared with bare Python and numpy
    chains    chains of up to a thousand loops
    size      cost against size: loops, designs, rows, each next to the floor; a chart; takes minutes
    all       all of these
    """  # noqa: D301  click leaves lines behind a backspace as they are
    wanted = MEASUREMENTS if ALL in what else what or MEASUREMENTS[:1]
    for option, is_given, users in (("--mechanism", mechanisms, ("accuracy",)), ("-o", folder, WITH_CHARTS)):
        if is_given and not set(users) & set(wanted):
            raise click.UsageError(f"{option} is for {listed(users)}, not for {listed(wanted)}")
    given = {} if rounds is None else {"rounds": rounds}
    for k, name in enumerate(dict.fromkeys(wanted)):
        if k:
            click.echo()
        if name == "accuracy":
            _accuracy(mechanisms, given, folder or (Path() if mechanisms else default_folder()))
        else:
            module, mechanism = TEXTS[name]
            measurement = import_module(f"benchmarks.{module}")  # each needs other packages
            chart = {"folder": folder or default_folder()} if name in WITH_CHARTS else {}
            click.echo(measurement.run(*map(gallery.load, mechanism), **given, **chart))


def default_folder() -> Path:
    """Return the folder of accuracy.md: docs/ of the checkout that runs this, else the current folder."""
    checkout = gallery.folder().parent / "docs"
    return checkout if (checkout / "accuracy.md").is_file() else Path()


def _accuracy(mechanisms: tuple[str, ...], given: dict[str, int], folder: Path) -> None:
    """Measure, print the short tables, write all tables and charts."""
    from benchmarks import accuracy, charts, page, singular

    mechanisms = mechanisms or accuracy.MECHANISMS
    rounds = given.get("rounds", accuracy.ROUNDS)
    page.check(folder)
    with Progress("measuring", 1) as show:
        done, all_steps = count(1), accuracy.steps(mechanisms, rounds) + singular.steps()

        def advance() -> None:
            show(min(next(done), all_steps), all_steps)

        measured, absent = accuracy.measure(mechanisms, rounds, advance)
        near, absent_too = singular.measure(rounds, advance)
    for line in dict.fromkeys((*absent, *absent_too)):
        click.echo(f"left out: {line}", err=True)
    parts = page.parts(measured, near, rounds)
    click.echo("\n\n".join(parts.values()))
    written = list(page.write(folder, parts, page.settings_table(measured)))
    try:
        written += charts.draw(folder, measured, near)
    except MissingPackageError as error:
        click.echo(f"left out: {error}", err=True)
    click.echo(f"\nwritten: {listed(map(str, written))}")


if __name__ == "__main__":
    main(prog_name="scripts/bench")
