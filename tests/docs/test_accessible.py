"""Pages of the built site, without violations of axe-core's rules, in both themes, on a desktop and on a phone."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.docs.screens import PAGES, SITE, opened
from tests.page.axe import needs_axe, violations
from tests.page.engines import browser, needs_browser


@needs_browser
@needs_axe
@pytest.mark.long
@pytest.mark.skipif(
    not all((SITE / f"{page}.html").is_file() for page in PAGES), reason="the site is not built; scripts/docs builds it"
)
def test_pages_of_the_site_are_accessible(tmp_path: Path) -> None:
    with browser(tmp_path) as chromium:
        found = [f"{name}: {line}" for name, tab in opened(chromium, PAGES) for line in violations(tab)]
    assert found == []
