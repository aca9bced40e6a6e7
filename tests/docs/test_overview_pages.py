"""docs/architecture.md, docs/gallery.md and docs/commands.md: what they list is what there is."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import kinfmu
from kinfmu.cli import main
from kinfmu.mechanism import gallery

ROOT = Path(__file__).parents[2]
ARCHITECTURE, GALLERY, COMMANDS, README = (
    (ROOT / name).read_text(encoding="utf-8")
    for name in ("docs/architecture.md", "docs/gallery.md", "docs/commands.md", "README.md")
)


def test_the_architecture_lists_every_package() -> None:
    packages = {path.name for path in (ROOT / "kinfmu").iterdir() if (path / "__init__.py").is_file()}
    assert set(re.findall(r"`kinfmu/(\w+)/", ARCHITECTURE)) == packages


def test_the_architecture_lists_every_module_outside_packages() -> None:
    modules = {path.name for path in (ROOT / "kinfmu").glob("*.py")} - {"__init__.py", "__main__.py"}
    listed = ARCHITECTURE.partition("\n## Other folders")[0]
    assert modules <= set(re.findall(r"(\w+\.py)`", listed))


def test_the_architecture_lists_packages_in_the_order_of_imports() -> None:
    config = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    (layers,) = (each["layers"] for each in config["tool"]["importlinter"]["contracts"] if each["type"] == "layers")
    level = {name.strip(): k for k, layer in enumerate(reversed(layers)) for name in layer.split("|")}
    listed = [level[name] for name in re.findall(r"^\| `kinfmu/(\w+)/", ARCHITECTURE, re.MULTILINE)]
    assert listed == sorted(listed)


def test_the_first_page_lists_every_extra_for_users() -> None:
    page = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    config = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    extras = set(config["project"]["optional-dependencies"]) - {"dev", "docs", "hosts"}  # those of a checkout
    assert set(re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE)) == extras


def test_the_paths_of_the_architecture_exist() -> None:
    paths = re.findall(r"`((?:kinfmu|scripts|fmus|tests|docs)/[\w/.]*)[ `]", ARCHITECTURE)
    assert len(paths) > 30
    for path in set(paths) - {"docs/_build"}:  # there once scripts/docs has run
        assert (ROOT / path).exists(), path


def test_the_architecture_lists_every_script() -> None:
    scripts = {path.name for path in (ROOT / "scripts").iterdir() if path.is_file() and not path.suffix}
    assert set(re.findall(r"^\| `scripts/(\w+)` \|", ARCHITECTURE, re.MULTILINE)) == scripts
    assert "docs/architecture.md#scripts" in README


def test_the_gallery_page_lists_every_mechanism_with_its_title() -> None:
    listed = re.findall(r"^\| \[`(\w+)`\]\(\.\./fmus/(\w+)/README\.md\) \| (.+?) \| .+ \|$", GALLERY, re.MULTILINE)
    assert listed == [(name, name, kinfmu.load(name).title) for name in gallery.names()]
    assert f"comes with {len(gallery.names())} mechanisms" in GALLERY


def test_the_commands_page_shows_every_command() -> None:
    assert set(re.findall(r"^    kinfmu (\w+)", COMMANDS, re.MULTILINE)) == set(main.commands)


def test_the_commands_page_explains_every_line_of_the_report() -> None:
    source = (ROOT / "kinfmu" / "analysis" / "text.py").read_text(encoding="utf-8")
    subjects = set(re.findall(r"ReportLine\(\s*f?\"([a-z ]+?)(?: \{k\})?\"", source))
    assert len(subjects) > 20
    table = COMMANDS.split("## The report of `check`")[1].split("\n## ")[0]
    explained = re.findall(r"`([^`]+)`", " ".join(re.findall(r"^\| (.+?) \|", table, re.MULTILINE)))
    assert subjects <= set(explained)


def test_every_link_between_the_pages_leads_to_a_file() -> None:
    made = ("reference/",)  # while the site is built; scripts/docs checks links to them
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))):
        for target in re.findall(r"\]\(([\w./-]+)(?:#[\w-]+)?\)", page.read_text(encoding="utf-8")):
            assert target.startswith(made) or (page.parent / target).exists(), f"{page.name}: {target}"


def test_the_readme_leads_to_every_page() -> None:
    for_the_site = {
        "docs/index.md",
        "docs/howto.md",
        "docs/method.md",
        "docs/reference.md",
        "docs/accuracy-settings.md",
    }
    pages = {f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md")} - for_the_site
    assert pages <= set(re.findall(r"\((docs/[\w-]+\.md)\)", README))
