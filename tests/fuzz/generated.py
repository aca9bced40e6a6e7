"""What kinfmu generates from a mechanism, looked through for texts that became code."""

from __future__ import annotations

import io
import re
import tokenize
import zipfile
from collections.abc import Iterator
from html.parser import HTMLParser
from xml.etree import ElementTree as ET

from kinfmu.fmu import python_flavour
from kinfmu.fmu.description import FmiVersion
from kinfmu.fmu.native.archive import _contents
from kinfmu.fmu.variables import interface
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.toml_file import parse
from kinfmu.mechanism.toml_text import text
from kinfmu.plan import compile_plan
from tests.fuzz.hostile_text import CANARY

_C = re.compile(r'/\*.*?\*/|//[^\n]*|"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)*\'', re.DOTALL)
_PATH = re.compile(r"[A-Za-z0-9_.-]+(?:/[A-Za-z0-9_.-]+)*")
_ATTRIBUTES = {("html", "lang"), ("meta", "charset")}
_TAGS = {"html", "head", "meta", "title", "style", "body", "h1", "h2", "p", "code", "sup", "table", "tr", "td", "th"}


def faults(mechanism: Mechanism) -> Iterator[str]:
    """Every place where a text of the mechanism became code, markup or a path."""
    if parse(text(mechanism)) != mechanism:
        yield "the mechanism differs after writing and reading"
    plan = compile_plan(mechanism)
    with zipfile.ZipFile(io.BytesIO(python_flavour.archive(plan, "time", "0"))) as archive:
        yield from _archive_faults({name: archive.read(name) for name in archive.namelist()}, mechanism)
    versions: tuple[FmiVersion, ...] = ("2.0", "3.0")
    for version in versions:
        variables = interface(plan, "time", has_time=version == "3.0")
        yield from _archive_faults(_contents(plan, variables, "0", version, "{}", None), mechanism)


def _archive_faults(contents: dict[str, bytes], mechanism: Mechanism) -> Iterator[str]:
    for name, data in contents.items():
        if not _PATH.fullmatch(name) or ".." in name or CANARY in name:
            yield f"path {name!r} in the FMU"
        if name.startswith("binaries/") or name.endswith(".txt"):
            continue
        content = data.decode()
        if name.endswith(".py"):
            yield from (f"{name}: {found}" for found in _python_faults(content))
        elif name.endswith((".c", ".h")):
            yield from (f"{name}: {found}" for found in _c_faults(content))
        elif name.endswith(".xml"):
            yield from (f"{name}: {found}" for found in _xml_faults(content, mechanism))
        elif name.endswith(".html"):
            yield from (f"{name}: {found}" for found in _html_faults(content))


def _python_faults(content: str) -> Iterator[str]:
    compile(content, "generated", "exec")
    for token in tokenize.generate_tokens(io.StringIO(content).readline):
        if token.type not in (tokenize.STRING, tokenize.COMMENT) and CANARY in token.string:
            yield f"token {token.string!r}"


def _c_faults(content: str) -> Iterator[str]:
    code = _C.sub('""', content)
    if CANARY in code or '"' in code.replace('""', "") or "*/" in code or "??/" in content:
        yield "a text is taken for code"


def _xml_faults(content: str, mechanism: Mechanism) -> Iterator[str]:
    root = ET.fromstring(content)  # noqa: S314  # written just now
    if any(CANARY in element.tag or CANARY in " ".join(element.attrib) for element in root.iter()):
        yield "a text is taken for markup"
    if root.tag == "fmiModelDescription" and root.get("description") != (mechanism.title or mechanism.name):
        yield f"the title reads {root.get('description')!r}"
    descriptions = {one.description for one in mechanism.parameters.values() if one.description}
    if not descriptions <= {element.get("description") for element in root.iter()} and "Variables" in content:
        yield "a description does not read back"


def _html_faults(content: str) -> Iterator[str]:
    tags: list[str] = []

    class Tags(HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            tags.append(tag)
            tags.extend(f"{tag} {name}" for name, _ in attrs if (tag, name) not in _ATTRIBUTES)

        def handle_comment(self, data: str) -> None:
            tags.append(f"comment {data}")

        def handle_decl(self, decl: str) -> None:
            if decl.lower() != "doctype html":
                tags.append(f"declaration {decl}")

    Tags().feed(content)
    yield from (f"markup {tag!r}" for tag in tags if tag not in _TAGS)
