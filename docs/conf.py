"""The documentation site: what Sphinx builds from this folder. `scripts/docs` runs it."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # for _site

from kinfmu.version import VERSION

project = "kinfmu"
author = "The kinfmu authors"
copyright = "2026, the kinfmu authors"  # noqa: A001  the name that Sphinx reads
version = release = VERSION

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "_site"]
exclude_patterns = ["_*"]
templates_path: list[str] = []
highlight_language = "none"  # indented blocks are commands and formulas
default_role = "code"  # single backticks in docstrings
smartquotes = False  # quotes in docstrings are those of code
nitpicky = True
nitpick_ignore_regex = [  # types in signatures that the site does not describe
    ("py:.*", r"(numpy|np|collections|os|pathlib)\..*"),
    ("py:.*", r"(kinfmu\..*\.)?[A-Z]\w*"),
]
suppress_warnings = ["config.cache"]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
html_math_renderer = "drawn"

autodoc_typehints = "none"  # docstrings state shapes and units
autodoc_type_aliases = {name: name for name in ("FloatArray", "IntArray", "CoordinateName", "InputName", "ForceName")}
autodoc_member_order = "bysource"
napoleon_numpy_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True

html_theme = "pydata_sphinx_theme"
html_title = "kinfmu"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = [("site.js", {"defer": "defer"})]
html_favicon = "_static/favicon.svg"
html_show_sourcelink = False
html_copy_source = False
html_context = {"default_mode": "auto"}  # light or dark
html_theme_options = {
    "navbar_align": "left",
    "header_links_before_dropdown": 6,
    "navigation_with_keys": False,
    "show_prev_next": True,
    "secondary_sidebar_items": {"**": ["page-toc"], "index": [], "gallery": []},
    "footer_start": ["copyright"],
    "footer_end": [],
}
html_sidebars = {"tutorial": [], "index": [], "gallery": []}
