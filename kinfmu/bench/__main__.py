"""python -m kinfmu.bench [sample] [step] [import]: measurements on this machine, side by side with their baselines."""

from __future__ import annotations

import platform

import click

from kinfmu.gallery import load


@click.command()
@click.argument("what", nargs=-1, type=click.Choice(["sample", "step", "import"]))
def main(what: tuple[str, ...]) -> None:
    """Time a sample of solve (sample), a step of the FMU (step), the import (import); all if nothing is said."""
    wanted = what or ("sample", "step", "import")
    click.echo(f"{platform.processor() or platform.machine()}, Python {platform.python_version()}")
    if "sample" in wanted:
        from kinfmu.bench import solve_sample

        click.echo(f"\n{solve_sample.run()}")
    if "step" in wanted:
        from kinfmu.bench import fmu_step

        click.echo()
        fmu_step.run(load("fourbar"))
    if "import" in wanted:
        from kinfmu.bench import import_time

        click.echo(f"\n{import_time.run()}")


if __name__ == "__main__":
    main()
