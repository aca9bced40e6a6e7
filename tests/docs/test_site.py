"""The documentation site: each page is in a table of contents; its generated pages hold every public name and option.

`scripts/docs`, which continuous integration runs, builds it and takes every warning as an error.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import kinfmu
from kinfmu.cli import main
from kinfmu.mechanism import gallery
from kinfmu.mechanism.drivers import DRIVERS
from kinfmu.mechanism.joints import JOINTS
from kinfmu.mechanism.laws import LAWS
from kinfmu.mechanism.loads import LOADS
from kinfmu.mechanism.quantities import POSE_QUANTITIES

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture
def site(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The modules that generate pages."""
    monkeypatch.syspath_prepend(str(DOCS))
    yield __import__("importlib").import_module
    for name in [name for name in sys.modules if name.partition(".")[0] == "_site"]:
        del sys.modules[name]


def test_every_page_is_in_one_table_of_contents() -> None:
    listed = []
    for page in DOCS.glob("*.md"):
        for block in re.findall(r"```\{toctree\}\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
            lines = [line for line in block.splitlines() if line and not line.startswith(":")]
            listed += [line.split("<")[-1].rstrip(">") for line in lines]
    generated = [name for name in listed if name.startswith("reference/")]
    assert sorted(name for name in listed if name not in generated) == sorted(
        page.stem for page in DOCS.glob("*.md") if page.stem != "index"
    )


def test_the_api_pages_hold_every_public_name(site: Any, tmp_path: Path) -> None:
    pages = site("_site.pages").Pages(tmp_path)
    site("_site.api").write(pages)
    text = "".join(path.read_text(encoding="utf-8") for path in pages.written)
    documented = set(re.findall(r"^\.\. auto\w+:: kinfmu\.([\w.]+)$", text, re.MULTILINE))
    modules = {"design", "draw", "log", "measures"}
    assert set(kinfmu.__all__) - modules - {"VERSION"} <= documented
    assert {f"log.{name}" for name in kinfmu.log.__all__} <= documented
    assert (tmp_path / "reference" / "api.md").is_file()


def test_the_page_of_the_command_line_holds_every_option(site: Any, tmp_path: Path) -> None:
    site("_site.command_line").write(site("_site.pages").Pages(tmp_path))
    sections = (tmp_path / "reference" / "command-line.md").read_text(encoding="utf-8").split("\n## ")[1:]
    assert [section.split("`")[1] for section in sections] == main.list_commands(None)  # type: ignore[arg-type]
    for section in sections:
        options = {name for option in main.commands[section.split("`")[1]].params for name in option.opts}
        assert {name for name in options if name.startswith("-")} <= set(re.findall(r"--?[\w-]+", section))


def test_a_page_of_the_gallery_has_figure_report_file_and_reference(site: Any) -> None:
    page = site("_site.gallery")._page("fourbar")
    mechanism = kinfmu.load("fourbar")
    assert page.startswith(f"# {mechanism.title}\n\n```{{raw}} html\n<iframe ")
    assert page.count("<details") == 4
    assert str(kinfmu.check(mechanism)) in page
    for name in ("figure.svg", "mechanism.toml", "reference.csv"):
        assert f"../../fmus/fourbar/{name}>`" in page
    assert "| `time` | `crank.phi` |" in page
    assert "| 10 | 0.174532925199433 | 1.98480775301221 | 0.17364817766693 |" in page


def test_links_to_folders_of_the_gallery_lead_to_its_pages(site: Any) -> None:
    source = ["[`engine`](../fmus/engine/README.md) and [page](fmu.md)"]
    site("_site.gallery").linked(None, "cams", source)
    assert source == ["[`engine`](gallery/engine.md) and [page](fmu.md)"]


def test_every_mechanism_of_the_gallery_has_a_card(site: Any) -> None:
    source = [(DOCS / "gallery.md").read_text(encoding="utf-8")]
    site("_site.gallery").linked(None, "gallery", source)
    assert re.findall(r"^gallery/(\w+)$", source[0], re.MULTILINE) == gallery.names()
    assert sorted(re.findall(r'<a class="card" href="gallery/(\w+)\.html">', source[0])) == gallery.names()
    assert "| what it shows |" not in source[0]
    assert site("_site.live").drawn(kinfmu.load("fourbar")).startswith("<svg ")


def test_every_type_has_an_example_that_solves_and_is_drawn(site: Any) -> None:
    examples = site("_site.examples")
    groups = {"joints": JOINTS, "drivers": DRIVERS, "loads": LOADS, "measures": POSE_QUANTITIES, "laws": LAWS}
    source = [(DOCS / "mechanism-files.md").read_text(encoding="utf-8")]
    examples.added(None, "mechanism-files", source)
    for group, classes in groups.items():
        assert list(examples.examples()[group]) == [cls.type for cls in classes]
        for cls in classes:
            mechanism = examples.mechanism(group, cls.type)
            assert kinfmu.check(mechanism).problem is None, cls.type
            assert kinfmu.solve(mechanism).good.all(), cls.type
            assert f'"{cls.type}"' in examples.shown(group, cls.type)
            assert examples.shown(group, cls.type) in source[0]
    assert source[0].count('<img class="example ') == sum(map(len, groups.values())) - len(POSE_QUANTITIES)


def test_formulas_of_docstrings_are_set(site: Any) -> None:
    latex = site("_site.formulas").latex
    assert latex("Phi = n.d    (1 row, scale 1)") == r"\Phi =n \cdot d \quad \text{(1 row, scale 1)}"
    assert latex("e = -damping ds/dt    along    s = |d|").endswith(r"\dot s  \quad \text{along} \quad s=|d|")


@pytest.mark.long
def test_quotes_in_the_api_are_those_of_code(tmp_path: Path) -> None:
    pytest.importorskip("myst_parser")
    names = "".join(f".. autofunction:: kinfmu.{name}\n" for name in ("solve", "measure", "fit", "build", "simulate"))
    (tmp_path / "index.rst").write_text(f"API\n===\n\n{names}", "utf-8")
    plain = "myst_parser,sphinx.ext.autodoc,sphinx.ext.napoleon,sphinx.ext.mathjax"
    settings = (f"extensions={plain}", "html_math_renderer=mathjax", "html_theme=basic")
    options = [part for setting in settings for part in ("-D", setting)]
    command = [sys.executable, "-m", "sphinx", "-q", "-c", str(DOCS), *options, str(tmp_path), str(tmp_path / "out")]
    subprocess.run(command, check=True, capture_output=True)
    text = (tmp_path / "out" / "index.html").read_text("utf-8")
    assert "'crank.speed'" in text or "&quot;crank.speed&quot;" in text or '"crank.speed"' in text
    assert not set("\u2018\u2019\u201c\u201d") & set(text)
