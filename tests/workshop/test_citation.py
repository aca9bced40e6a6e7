"""CITATION.cff has what the format requires, and the version and licence of the package."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from kinfmu.version import VERSION

CHECKOUT = Path(__file__).parents[2]
TEXT = (CHECKOUT / "CITATION.cff").read_text(encoding="utf-8")


def _value(key: str) -> str:
    (value,) = re.findall(rf"^{key}: (.+)$", TEXT, re.MULTILINE)
    return str(value).strip('"')


def test_the_citation_has_the_required_keys_and_the_version_of_the_package() -> None:
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert _value("cff-version") == "1.2.0"
    assert _value("message")
    assert _value("title").startswith("kinfmu")
    assert _value("version") == VERSION
    assert _value("license") == project["license"]
    assert re.findall(r"^  - name: (.+)$", TEXT, re.MULTILINE) == [author["name"] for author in project["authors"]]
