"""Files in an FMU that people and hosts may read, and that its binaries do not need.

    documentation/index.html
    model.png                          (FMI 2.0) the icon
    terminalsAndIcons/icon.png, .svg   (FMI 3.0), with terminalsAndIcons.xml
    extra/org.kinfmu/                  reference results

They are not part of the content that the token identifies, so a change of them leaves the token as it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from types import MappingProxyType

from kinfmu.analysis.driver_path import follow
from kinfmu.analysis.singular import DriverRange, driver_range
from kinfmu.errors import KinfmuError
from kinfmu.fmu import reference, terminals
from kinfmu.fmu.documentation import page
from kinfmu.fmu.interface import Interface
from kinfmu.fmu.picture import picture, png, svg
from kinfmu.plan import SolvePlan


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
        if self.fmi == 3:
            contents[f"{terminals.FOLDER}/terminalsAndIcons.xml"] = terminals.terminals(self.plan, variables)
        if drawn is None:
            return contents
        if self.fmi == 2:
            return contents | {"model.png": png(drawn)}
        folder = terminals.FOLDER
        return contents | {f"{folder}/icon.png": png(drawn), f"{folder}/icon.svg": image.encode()}


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
