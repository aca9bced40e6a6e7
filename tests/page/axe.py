"""What axe-core, the checker of accessibility that browsers run, finds in a page. `scripts/browser` installs it."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import pytest

_PLACES = [*os.environ.get("NODE_PATH", "").split(os.pathsep), str(Path(sys.prefix, "node_modules"))]
AXE = next((path for place in _PLACES if place and (path := Path(place, "axe-core", "axe.min.js")).is_file()), None)
needs_axe = pytest.mark.skipif(AXE is None, reason="axe-core is not installed; scripts/browser installs it")


def violations(tab: Any) -> list[str]:
    """Return rule and element of what axe finds in a page, and in pages embedded in it."""
    assert AXE is not None
    tab.wait_for_timeout(200)  # colours of buttons fade
    for frame in tab.frames:
        if not frame.evaluate("'axe' in window"):
            frame.evaluate(AXE.read_text("utf-8"))
    found = tab.evaluate("axe.run()")
    assert len(found["passes"]) > 10
    return [f"{one['id']}: {node['html'][:200]}" for one in found["violations"] for node in one["nodes"]]
