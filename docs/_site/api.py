"""The pages of the Python API: every public name, from its docstring."""

from __future__ import annotations

import inspect
from collections import defaultdict
from importlib import import_module
from operator import attrgetter
from pathlib import Path

import kinfmu
from _site.docstrings import declares_keys
from _site.pages import Pages
from kinfmu.run.tables import Tabular

GROUPS = {  # the package, or part of `mechanism`, from which the stub imports a name: title of its page, what it is for
    "gallery": ("Loading and saving", "Mechanisms by the name of a gallery entry or a file."),
    "mechanism": ("Mechanisms", "What you write: bodies, points, start poses, parameters."),
    "joints": ("Joints", "Constraints between bodies; `Mechanism` takes a list of them."),
    "drivers": ("Drivers", "A measured quantity that follows a law of time."),
    "laws": ("Laws", "How one quantity follows another: of drivers over time, of cams and couplings over an angle."),
    "loads": ("Loads", "Forces and torques on bodies."),
    "quantities": ("Quantities of a pose", "What is held, driven, coupled or measured."),
    "measures": ("Measures of a motion", "Numbers read off a motion, which `[measures]` of a file declares."),
    "analysis": ("Checking", "The report of a mechanism: mobility, redundant rows, range, singular points."),
    "run": ("Solving", "Many samples of a mechanism, and of thousands of designs; the run that holds them."),
    "solver": ("Status of a sample", "The quality of a sample."),
    "motion": ("Measuring", "Measures of one motion and of designs."),
    "page": ("The page", "A mechanism that is dragged in a notebook."),
    "design": ("Studies and fits", "Many designs by grids, samples and tolerances; parameters for a task."),
    "fmu": ("FMUs", "Building and stepping them."),
    "log": ("Records", "Files of runs, in `kinfmu.log`."),
    "draw": ("Pictures", "Figures, plots and animations, in `kinfmu.draw`."),
    "errors": ("Exceptions", "All are a `KinfmuError`, with the data of their message as attributes."),
}
MODULES = {"design", "draw", "log", "measures"}  # public as modules: all their names


def write(pages: Pages) -> None:
    """Write reference/api.md and a page for each group."""
    names = _names()
    unknown = set(names) - set(GROUPS)
    if unknown:
        raise ValueError(f"{Path(__file__).name}: no group for the public names of {', '.join(sorted(unknown))}")
    lines = [f"* [{title}](api-{group}.md): {_listed(names[group])}" for group, (title, _) in GROUPS.items()]
    toctree = "\n".join(f"api-{group}" for group in GROUPS)
    pages.write(
        "reference/api.md",
        "# Python API\n\nEvery public name, by topic. The names are those of `import kinfmu`, unless another module is "
        "shown.\n\n" + "\n".join(lines) + f"\n\n```{{toctree}}\n:hidden:\n\n{toctree}\n```\n",
    )
    for group, (title, words) in GROUPS.items():
        body = "\n".join(_directive(name) for name in names[group])
        pages.write(f"reference/api-{group}.md", f"# {title}\n\n{words}\n\n```{{eval-rst}}\n{body}```\n")


def _names() -> dict[str, list[str]]:
    """Return the full names of each group, in the order in which the stub lists them."""
    found: dict[str, list[str]] = defaultdict(list)
    homes = {name: home for name, home in kinfmu._homes(vars(kinfmu)).items() if name not in MODULES}
    for name, home in homes.items():
        found[group_of(home)].append(f"kinfmu.{name}")
    for module in sorted(MODULES):
        public = getattr(kinfmu, module).__all__
        found[module] += [f"kinfmu.{module}.{name}" for name in public if name not in homes and name != name.upper()]
    errors = import_module("kinfmu.errors")
    found["errors"] += [
        f"kinfmu.errors.{name}"
        for name, value in vars(errors).items()
        if inspect.isclass(value) and issubclass(value, kinfmu.KinfmuError) and value is not kinfmu.KinfmuError
    ]
    return found


def group_of(module: str) -> str:
    """Return the group of a module: its package, or the part of `kinfmu.mechanism` that it belongs to."""
    _, package, *inner = module.split(".")
    return inner[0] if package == "mechanism" and inner and inner[0] in GROUPS else package


def _directive(name: str) -> str:
    thing = attrgetter(name.removeprefix("kinfmu."))(kinfmu)
    if inspect.isclass(thing):
        members = "" if declares_keys(thing) else "   :members:\n"
        members += "   :inherited-members:\n" if issubclass(thing, Tabular) else ""
        return f".. autoclass:: {name}\n{members}\n"
    return f".. autofunction:: {name}\n\n" if callable(thing) else f".. autodata:: {name}\n\n"


def _listed(names: list[str]) -> str:
    return ", ".join(f"`{name.removeprefix('kinfmu.')}`" for name in names)
