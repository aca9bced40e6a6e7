"""Files in an FMU that people and hosts may read, and that its binaries do not need.

    documentation/index.html
    documentation/play.html            on request: the page in which the mechanism is dragged
    model.png                          (FMI 2.0) the icon
    terminalsAndIcons/icon.png, .svg   (FMI 3.0), with terminalsAndIcons.xml: one terminal for each driver
    extra/org.kinfmu/                  reference results
    extra/org.fmi-standard.fmi-ls-ref/ parameters, experiment, and the roles of all these files

They are not part of the content that the token identifies, so a change of them leaves the token as it is.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from html import escape
from types import MappingProxyType
from xml.etree.ElementTree import Element, SubElement

from kinfmu.analysis.driver_path import follow
from kinfmu.analysis.singular import DriverRange, driver_range
from kinfmu.errors import KinfmuError, RequestError, valid_names
from kinfmu.fmu import reference, related
from kinfmu.fmu.archive import zipped
from kinfmu.fmu.description.common import document
from kinfmu.fmu.documentation import page
from kinfmu.fmu.interface import Interface
from kinfmu.fmu.picture import picture, png, svg
from kinfmu.mechanism.valid import quoted
from kinfmu.plan import SolvePlan

PLACE = "documentation/play.html"
_INDEX = "documentation/index.html"
_LINK = (
    b'<p><a href="play.html">Drag the mechanism</a>: a page with the compiled code of this FMU, without a net.</p>\n'
)
METADATA = {  # by argument: attribute of FMI
    "author": "author",
    "version": "version",
    "license": "license",
    "copyright": "copyright",
    "date": "generationDateAndTime",
}
TERMINALS = "terminalsAndIcons"  # folder
KIND = "org.kinfmu.driver"
_SIDE = "100"  # of the icon, from its middle
_EDGES = {"x1": f"-{_SIDE}", "y1": f"-{_SIDE}", "x2": _SIDE, "y2": _SIDE}
_MIT = """\
MIT License

Copyright (c) 2026 The kinfmu authors

Permission is hereby granted, free of charge, to any person obtaining a copy
of this software and associated documentation files (the "Software"), to deal
in the Software without restriction, including without limitation the rights
to use, copy, modify, merge, publish, distribute, sublicense, and/or sell
copies of the Software, and to permit persons to whom the Software is
furnished to do so, subject to the following conditions:

The above copyright notice and this permission notice shall be included in all
copies or substantial portions of the Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR
IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY,
FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE
AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER
LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM,
OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE
SOFTWARE.
"""


@dataclass(frozen=True, eq=False)
class Documents:
    """What the documents of an FMU are made from.

    Attributes:
        plan: Plan of the mechanism.
        fmi: Version of FMI, 2 or 3.
        metadata: Attributes of the model description, such as `author`.
        reach: Range of the only driver, as written; None with several drivers, whose ranges depend on each other.
        display_length: Unit in which tools show lengths in m; None: m.

    """

    plan: SolvePlan
    fmi: int
    metadata: Mapping[str, str]
    reach: DriverRange | None
    display_length: str | None = None

    def files(self, variables: Interface) -> dict[str, bytes]:
        """Return the files by path in the FMU.

        Args:
            variables: Variables of the FMU.

        """
        run = reference.reference_run(self.plan)
        is_kinematic = not variables.part("states")  # with states the results depend on an integrator
        found = None if run is None or not is_kinematic else reference.reference(run, variables)
        drawn = None if run is None else picture(run)
        image = "" if drawn is None else svg(drawn, escape(variables.title or variables.name, quote=True))
        text = page(self.plan, variables, picture=image, reach=self.reach, reference=found, metadata=self.metadata)
        contents = {"documentation/index.html": text.encode()} | reference.files(variables.name, found)
        contents |= related.files(variables, found)
        if self.fmi == 3:
            contents[f"{TERMINALS}/terminalsAndIcons.xml"] = terminals(self.plan, variables)
        if drawn is None:
            return contents
        if self.fmi == 2:
            return contents | {"model.png": png(drawn)}
        return contents | {f"{TERMINALS}/icon.png": png(drawn), f"{TERMINALS}/icon.svg": image.encode()}


def documents(
    plan: SolvePlan, fmi: int, metadata: Mapping[str, str] = MappingProxyType({}), display_length: str | None = None
) -> Documents:
    """Return the documents of the FMU of a plan.

    Args:
        plan: The plan.
        fmi: Version of FMI, 2 or 3.
        metadata: Attributes of the model description. Default: none.
        display_length: Unit in which tools show lengths in m. Default: m.

    """
    return Documents(plan, fmi, metadata, _only_range(plan), display_length)


def _only_range(plan: SolvePlan) -> DriverRange | None:
    if len(plan.drivers) != 1:
        return None
    try:
        return driver_range(follow(plan, 0))
    except KinfmuError:
        return None


def terminals(plan: SolvePlan, variables: Interface) -> bytes:
    """Return terminalsAndIcons.xml of the FMU of a plan.

    A terminal is a bus: members connect by name, and need not all be connected. Its inputs are named by what they hold:
    angle (position, length), speed, acceleration, torque; its outputs as in the FMU: torque, bias_torque,
    reduced_inertia. Where the torque is an input, the output of that name is required_torque.
    """
    root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    graphics = SubElement(root, "GraphicalRepresentation")
    SubElement(graphics, "CoordinateSystem", _EDGES | {"suggestedScalingFactorTo_mm": "0.1"})
    SubElement(graphics, "Icon", _EDGES)
    if plan.drivers:
        drivers = SubElement(root, "Terminals")
        for driver in plan.drivers:
            about = f"Driver {driver.name}: its motion, and with masses its effort, bias and reduced inertia"
            terminal = SubElement(
                drivers, "Terminal", name=driver.name, matchingRule="bus", terminalKind=KIND, description=about
            )
            for variable, member in _members(driver.name, variables):
                SubElement(
                    terminal,
                    "TerminalMemberVariable",
                    variableName=variable,
                    memberName=member,
                    variableKind="signal",
                )
    return document(root)


def _members(driver: str, variables: Interface) -> Iterator[tuple[str, str]]:
    """Yield variables and the names of members, which are unique."""
    inputs = set()
    for variable in (*variables.part("inputs"), *variables.part("states"), *variables.part("efforts")):
        owner, _, noun = variable.name.rpartition("_")
        if owner == driver:
            inputs.add(noun)
            yield variable.name, noun
    for variable in variables.part("forces"):
        owner, _, noun = variable.name.partition(".")
        if owner == driver:
            yield variable.name, f"required_{noun}" if noun in inputs else noun


def attributes(metadata: Mapping[str, str]) -> dict[str, str]:
    """Return the attributes of fmiModelDescription for metadata.

    Args:
        metadata: Texts by name: author, version, license, copyright, date. A date has the form of ISO 8601, such as
            2026-05-01 or 2026-05-01T12:00:00+02:00; without a zone it is UTC.

    Raises:
        RequestError: A name is unknown, or a text is empty, has several lines, or is no date.

    """
    found = {}
    for name, text in metadata.items():
        if name not in METADATA:
            raise RequestError(f"metadata: '{name}' is not known{valid_names(name, METADATA)}")
        if not isinstance(text, str) or not text.strip() or not text.isprintable():
            raise RequestError(f"{name} = {quoted(text)} must be one line of text")
        found[METADATA[name]] = _utc(text) if name == "date" else text.strip()
    return found


def _utc(text: str) -> str:
    """Return a date as FMI writes it: YYYY-MM-DDThh:mm:ssZ."""
    try:
        date = datetime.fromisoformat(text.strip())
    except ValueError:
        raise RequestError(f"date = {quoted(text)} must be a date such as 2026-05-01 or 2026-05-01T12:00:00Z") from None
    date = date.replace(tzinfo=UTC) if date.tzinfo is None else date.astimezone(UTC)
    return date.strftime("%Y-%m-%dT%H:%M:%SZ")


def licence(*others: str) -> str:
    """Return documentation/licenses/license.txt: kinfmu's licence and other code inside.

    Args:
        others: Other code and the file of its licence, such as "pythonfmu, in pythonfmu.txt".

    """
    also = "".join(f"It also holds code of {other}.\n" for other in others)
    return f"""\
This FMU holds code of kinfmu, under the MIT License below. The mechanism in it belongs to its author.
{also}
{_MIT}"""


def completed(data: bytes, more: Mapping[str, bytes] = MappingProxyType({})) -> bytes:
    """Return an FMU with further files, a link to the page among them, and the manifest of all.

    The token of the FMU stays: it identifies what is computed.
    """
    with zipfile.ZipFile(io.BytesIO(data)) as given:
        contents = {name: given.read(name) for name in given.namelist()} | dict(more)
    if PLACE in more:
        before, end, after = contents[_INDEX].rpartition(b"</body>")
        contents[_INDEX] = before + _LINK + end + after
    return zipped(contents | {related.MANIFEST: related.manifest(contents)})
