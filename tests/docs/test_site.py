"""The documentation site: each page is in a table of contents; its generated pages hold every public name and option.

`scripts/docs`, which continuous integration runs, builds it and takes every warning as an error.
"""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import kinfmu
from kinfmu.cli import main
from kinfmu.mechanism import gallery

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
    assert page.startswith(f"# {mechanism.title}\n")
    assert str(kinfmu.check(mechanism)) in page
    for name in ("figure.svg", "mechanism.toml", "reference.csv"):
        assert f"../../fmus/fourbar/{name}>`" in page
    assert "| `time` | `crank.phi` |" in page
    assert "| 10 | 0.174532925199433 | 1.98480775301221 | 0.17364817766693 |" in page


def test_links_to_folders_of_the_gallery_lead_to_its_pages(site: Any) -> None:
    source = ["[`engine`](../fmus/engine/README.md) and [page](fmu.md)"]
    site("_site.gallery").linked(None, "gallery", source)
    assert source[0].startswith("[`engine`](gallery/engine.md) and [page](fmu.md)")
    assert re.findall(r"^gallery/(\w+)$", source[0], re.MULTILINE) == gallery.names()


@pytest.mark.parametrize(
    ("html", "fault"),
    [
        ('<a href="other.html">x</a>', "other.html does not exist"),
        ('<a href="#there">x</a>', "#there: no such place in the page"),
        ('<a href="index.html#here">x</a><p id="here">', ""),
        ('<a href="https://example.org/">x</a>', ""),
        ('<script src="https://example.org/a.js"></script>', "loads https://example.org/a.js from the network"),
        ('<img src="a%20b.png">', "a%20b.png does not exist"),
    ],
)
def test_the_check_of_links_finds_what_is_wrong(
    html: str, fault: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "index.html").write_text(html, encoding="utf-8")
    check = runpy.run_path(str(DOCS / "_site" / "links.py"))["main"]
    assert check(tmp_path) == (1 if fault else 0)
    assert (f"index.html: {fault}\n" in capsys.readouterr().err) == bool(fault)


def test_the_check_of_links_finds_fonts_from_the_net(tmp_path: Path) -> None:
    (tmp_path / "index.html").write_text("", encoding="utf-8")
    (tmp_path / "a.css").write_text('@import "https://example.org/font.css";', encoding="utf-8")
    check = runpy.run_path(str(DOCS / "_site" / "links.py"))["problems"]
    assert check(tmp_path) == ["a.css: loads a file from the network"]


GALLERY_PAGE = """<iframe src="live/fourbar.html"></iframe><a href="live/fourbar.html">live</a>
<a href="live/fourbar.fmu">FMU</a> <a href="../_downloads/1/mechanism.toml">file</a>
<a href="../_downloads/2/reference.csv">data</a> <a href="../_downloads/3/figure.svg">figure</a>"""


@pytest.fixture
def built(tmp_path: Path) -> Path:
    """A site with one page of the gallery."""
    (tmp_path / "gallery" / "live").mkdir(parents=True)
    (tmp_path / "gallery" / "fourbar.html").write_text(GALLERY_PAGE, encoding="utf-8")
    (tmp_path / "gallery" / "live" / "fourbar.html").write_text("<title>fourbar</title>", encoding="utf-8")
    kinfmu.build(kinfmu.load("fourbar"), tmp_path / "gallery" / "live" / "fourbar.fmu")
    for number, file in enumerate(("mechanism.toml", "reference.csv", "figure.svg"), start=1):
        target = tmp_path / "_downloads" / str(number) / file
        target.parent.mkdir(parents=True)
        target.write_bytes((gallery.folder() / "fourbar" / file).read_bytes())
    return tmp_path


def test_the_check_of_the_gallery_accepts_pages_with_all_their_files(site: Any, built: Path) -> None:
    problems = site("_site.contents").problems
    assert problems(built, ["fourbar"]) == []
    assert problems(built, ["fourbar", "engine"]) == ["gallery/engine.html: there is no such page"]


@pytest.mark.parametrize(
    ("link", "fault"),
    [
        ('<iframe src="live/fourbar.html">', "no link to live/fourbar.html"),
        ('<a href="live/fourbar.html">', "no link to live/fourbar.html"),
        ('<a href="live/fourbar.fmu">', "no link to live/fourbar.fmu"),
        ('<a href="../_downloads/1/mechanism.toml">', "no link to mechanism.toml"),
    ],
)
@pytest.mark.few(2)
def test_the_check_of_the_gallery_finds_a_missing_link(site: Any, built: Path, link: str, fault: str) -> None:
    page = built / "gallery" / "fourbar.html"
    assert link in GALLERY_PAGE
    page.write_text(GALLERY_PAGE.replace(link, ""), encoding="utf-8")
    assert site("_site.contents").problems(built, ["fourbar"]) == [f"gallery/fourbar.html: {fault}"]


def test_the_check_of_the_gallery_finds_files_of_another_mechanism(site: Any, built: Path) -> None:
    kinfmu.build(kinfmu.load("engine"), built / "gallery" / "live" / "fourbar.fmu")
    (built / "gallery" / "live" / "fourbar.html").write_text("<title>engine</title>", encoding="utf-8")
    (built / "_downloads" / "1" / "mechanism.toml").write_text('name = "engine"', encoding="utf-8")
    assert site("_site.contents").problems(built, ["fourbar"]) == [
        "gallery/fourbar.html: live/fourbar.html is not the page of fourbar",
        "gallery/fourbar.html: live/fourbar.fmu is an FMU of engine",
        "gallery/fourbar.html: ../_downloads/1/mechanism.toml is not mechanism.toml of fourbar",
    ]


def test_the_site_is_checked_when_it_is_built() -> None:
    script = (DOCS.parent / "scripts" / "docs").read_text(encoding="utf-8")
    assert "docs/_site/links.py docs/_build" in script
    assert "-m _site.contents docs/_build" in script


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
