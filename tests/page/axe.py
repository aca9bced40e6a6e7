"""What axe-core, the checker of accessibility that browsers run, finds in a page. `scripts/browser` installs it."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

FILE = Path(sys.prefix) / "node_modules" / "axe-core" / "axe.min.js"
needs_axe = pytest.mark.skipif(not FILE.is_file(), reason="axe-core is not installed; scripts/browser installs it")
RUN = """async () => (await axe.run()).violations.flatMap(({ id, nodes }) =>
    nodes.map(({ target, failureSummary }) => `${id}: ${target}: ${failureSummary}`))"""


def violations(tab: Any) -> list[str]:
    """Return a line for each element of a page, and of pages embedded in it, that violates a rule."""
    for frame in tab.frames:
        frame.add_script_tag(path=FILE)
    found: list[str] = tab.evaluate(RUN)
    return [" ".join(line.split()) for line in found]
