"""The widget of notebooks: traits that follow the page, a page that follows the traits."""

from __future__ import annotations

import json
import sys
import types
from pathlib import Path
from typing import Any

import pytest

import kinfmu
from kinfmu.page.player import widget
from tests.page.engines import browser, needs_browser

traitlets = pytest.importorskip("traitlets", reason="anywidget is not installed")
pytest.importorskip("anywidget", reason="anywidget is not installed")

SYNCED = ("page", "height", "values", "drivers", "problem", "file")
HOST = """<!doctype html><title>cell</title><div id="cell"></div><script type="module">
const state = %s, listeners = {};
window.model = {
    sent: {},
    get: (name) => state[name],
    set(name, value) { state[name] = this.sent[name] = value; },
    save_changes() {},
    on: (event, act) => (listeners[event] ||= new Set()).add(act),
    off: (event, act) => listeners[event]?.delete(act),
    receive(name, value) { state[name] = value; (listeners[`change:${name}`] || []).forEach((act) => act()); },
};
const url = URL.createObjectURL(new Blob([%s], { type: "text/javascript" }));
const { default: made } = await import(url);
window.end = made.render({ model: window.model, el: document.getElementById("cell") });
</script>"""


@pytest.fixture(scope="module")
def leg() -> kinfmu.Mechanism:
    return kinfmu.load("jansen_leg")


def test_parameters_are_traits_that_follow_the_values_both_ways(leg: kinfmu.Mechanism) -> None:
    live = kinfmu.play(leg)
    assert set(live.parameters.trait_names()) == set("abcdefghijklm")  # without those that follow from others
    assert live.drivers == {"crank": 0.0}
    other = traitlets.HasTraits()
    other.add_traits(value=traitlets.Float())
    traitlets.link((live.parameters, "m"), (other, "value"))
    other.value = 15.5
    assert live.values["m"] == live.parameters.m == 15.5
    live.values = {"m": 14.5}  # other values stay
    assert other.value == live.parameters.m == 14.5
    live.set(m=15.0)
    assert other.value == 15.0
    with pytest.raises(traitlets.TraitError, match=r"there is no value 'mm'; did you mean 'm'\?; values: a, b, "):
        live.set(mm=1.0)
    with pytest.raises(traitlets.TraitError, match="there is no driver 'krank'; did you mean 'crank'"):
        live.drivers = {"krank": 1.0}
    assert live.mechanism is leg


def test_a_mechanism_in_a_cell_of_jupyter_is_the_widget(leg: kinfmu.Mechanism, monkeypatch: pytest.MonkeyPatch) -> None:
    assert leg._repr_mimebundle_() is None  # a terminal asks as well
    shell = types.SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: shell))  # type: ignore[arg-type]
    bundle: Any = leg._repr_mimebundle_()
    data = bundle[0] if isinstance(bundle, tuple) else bundle
    assert "application/vnd.jupyter.widget-view+json" in data
    assert isinstance(leg._display_(), widget._widget_class())  # in marimo
    open_loop = kinfmu.load("fourbar_chain:100")
    assert open_loop._repr_mimebundle_() is None  # its page takes long: the drawing


@needs_browser
@pytest.mark.long
def test_the_frame_and_the_traits_follow_each_other(leg: kinfmu.Mechanism, tmp_path: Path) -> None:
    live = kinfmu.play(leg)
    state = {name: getattr(live, name) for name in SYNCED}
    script = Path(widget.__file__).with_name("widget.js").read_text("utf-8")
    texts = [json.dumps(one).replace("<", "\\u003c") for one in (state, script)]
    host = tmp_path / "cell.html"
    host.write_text(HOST.replace("%s", "\0").replace("\0", texts[0], 1).replace("\0", texts[1], 1), "utf-8")
    with browser(tmp_path) as chromium, chromium.tab() as page:
        page.tab.goto(host.as_uri())
        inner = "document.querySelector('iframe').contentWindow.kinfmu"
        page.tab.wait_for_function("window.model?.sent.file")
        assert page.tab.evaluate(f"Object.fromEntries({inner}.design.values)") == pytest.approx(live.values)
        page.tab.evaluate("window.model.receive('drivers', { crank: 1.25 })")
        page.tab.wait_for_function(f"{inner}.linkage.u[0] === 1.25")
        changed = {**live.values, "m": 15.5}
        page.tab.evaluate("values => window.model.receive('values', values)", changed)
        page.tab.wait_for_function(f"{inner}.linkage.bound.get('m') === 15.5")
        page.tab.wait_for_function("/15[.]5/.test(window.model.sent.file)")  # the mechanism follows what Python sets
        page.tab.evaluate(f"{inner}.setValues({{ l: 8 }})")
        page.tab.wait_for_function("window.model.sent.values?.l === 8")
        page.tab.evaluate(f"{inner}.setValues({{ b: 1 }})")
        page.tab.wait_for_function("window.model.sent.problem")
        page.tab.evaluate(f"{inner}.setValues({{ b: 41.5 }})")
        page.tab.wait_for_function("window.model.sent.problem === ''")
        page.tab.wait_for_timeout(200)
        sent = page.tab.evaluate("window.model.sent")
        page.tab.evaluate("window.end()")
        assert page.tab.locator("iframe").count() == 0
        assert page.errors == []
    live.set_state({name: sent[name] for name in ("values", "file", "problem")})
    assert live.parameters.m == 15.5
    assert live.parameters.l == 8.0
    assert live.mechanism.parameters["l"].value == 8.0
    assert live.mechanism.parameters["m"].value == 15.5
    assert kinfmu.check(live.mechanism).problem is None
