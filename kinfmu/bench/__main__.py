"""python -m kinfmu.bench [sample] [step] [import] [chains]: measurements on this machine, with their baselines."""

from __future__ import annotations

import platform

import click

from kinfmu.gallery import load


@click.command()
@click.argument("what", nargs=-1, type=click.Choice(["sample", "step", "import", "chains"]))
def main(what: tuple[str, ...]) -> None:
    """Time a sample of solve (sample), a step of the FMU (step), the import (import), long chains (chains).

    All if nothing is said.
    """
    wanted = what or ("sample", "step", "import", "chains")
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
    if "chains" in wanted:
        from kinfmu.bench import chains

        click.echo(f"\n{chains.run()}")


if __name__ == "__main__":
    main()
