"""A mechanism that is dragged in a notebook: the page in a frame; values and driver values are traits of a widget."""

from __future__ import annotations

from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from kinfmu.errors import MissingPackageError, listed, suggestion
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.mechanism import require_mechanism
from kinfmu.mechanism.opened import opened
from kinfmu.mechanism.toml_file import parse
from kinfmu.page import page
from kinfmu.page.html import MOST_NUMBERS
from kinfmu.page.module import page_module

_SCRIPT = Path(__file__).with_name("widget.js")
_HOOK = "started.then((page) => { page.file = () => mechanismFile(page.linkage, page.design); });"
_KEPT = 8  # pages
HEIGHT = 620  # [px]


def play(mechanism: Mechanism, height: int = HEIGHT) -> Any:
    """Return the live mechanism for a cell of Jupyter or marimo: an anywidget that shows the page of `kinfmu play`.

    Its traits follow the page, and the page follows them:

    * `values`: all values that can be set, by name: parameters, constants of laws such as 'crank.speed', and plain
      numbers of the file such as 'bodies.crank.points.P.x'. Lengths are in the file's unit, angles in radians.
    * `drivers`: the value of each driver by name, in the file's unit or in radians.
    * `parameters`: an object with one trait for each parameter of the file, to link with other widgets.
    * `problem`: why the mechanism does not close with these values; empty if it does.

    `mechanism` is the mechanism with the values as set.

    Args:
        mechanism: The mechanism.
        height: Of the page [px].

    Raises:
        KinfmuError: The mechanism cannot be solved.
        RequestError: It is too large for a page.
        MissingPackageError: anywidget is not installed (`pip install 'kinfmu[notebook]'`).

    """
    require_mechanism(mechanism, "play")
    return _widget_class()(mechanism, height)


@lru_cache(maxsize=_KEPT)
def _page(mechanism: Mechanism) -> str:
    return page(mechanism, script=_HOOK)


@lru_cache(maxsize=_KEPT)
def _values(mechanism: Mechanism) -> dict[str, float]:
    """Return what the page can set, by name."""
    change = opened(mechanism)
    is_open = 0 < len(change.places) <= MOST_NUMBERS
    module = page_module(change.mechanism, change.labels) if is_open else page_module(mechanism)
    found: list[Any] = [*module.plan.parameters, *module.plan.law_constants]
    return {name: float(one.value) for name, one in zip(module.parameters, found, strict=True)}


@cache
def _widget_class() -> Any:
    """Return the class of the widget; anywidget is imported when it is first needed."""
    try:
        import anywidget
        import traitlets
    except ImportError:
        raise MissingPackageError("a live mechanism needs anywidget; pip install 'kinfmu[notebook]'") from None

    class LiveMechanism(anywidget.AnyWidget):  # type: ignore[misc,unused-ignore]  # untyped without anywidget
        _esm = _SCRIPT.read_text("utf-8")
        page = traitlets.Unicode().tag(sync=True)
        height = traitlets.Int(HEIGHT, min=200).tag(sync=True)
        values = traitlets.Dict(traitlets.Float()).tag(sync=True)
        drivers = traitlets.Dict(traitlets.Float()).tag(sync=True)
        problem = traitlets.Unicode().tag(sync=True)
        file = traitlets.Unicode().tag(sync=True)

        def __init__(self, mechanism: Mechanism, height: int) -> None:
            values = _values(mechanism)
            drivers = {one.name: float(one.law.at(mechanism.run.start)) for one in mechanism.drivers}
            self._known = {"value": tuple(values), "driver": tuple(drivers)}
            self._given = mechanism
            super().__init__(page=_page(mechanism), height=height, values=dict(values), drivers=drivers)
            self.parameters = traitlets.HasTraits()
            own = [name for name in mechanism.parameters if name in values]
            self.parameters.add_traits(**{name: traitlets.Float(values[name]) for name in own})
            self.parameters.observe(self._take_parameter, names=own)
            self.observe(self._give_parameters, names="values")

        @property
        def mechanism(self) -> Mechanism:
            """The mechanism with the values as the page last reported them."""
            return parse(self.file, self._given.name) if self.file else self._given

        def set(self, **values: float) -> None:
            """Set parameters by name; other values stay as they are."""
            self.values = {**self.values, **values}

        @traitlets.validate("values", "drivers")
        def _checked(self, proposal: Any) -> dict[str, float]:
            """Return values of all names; those that are not given stay as they are."""
            what = "value" if proposal["trait"].name == "values" else "driver"
            known, given = self._known[what], proposal["value"]
            for name in given:
                if name not in known:
                    raise traitlets.TraitError(
                        f"there is no {what} '{name}'{suggestion(name, known)}; {what}s: {listed(known)}"
                    )
            now = getattr(self, proposal["trait"].name)
            return {name: float(given.get(name, now.get(name, 0.0))) for name in known}

        def _take_parameter(self, change: Any) -> None:
            if self.values[change["name"]] != change["new"]:
                self.values = {**self.values, change["name"]: change["new"]}

        def _give_parameters(self, change: Any) -> None:
            for name in self.parameters.trait_names():
                setattr(self.parameters, name, change["new"][name])

    return LiveMechanism
