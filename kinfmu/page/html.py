"""`page`: the files of web/, the compiled mechanism and its data in one HTML text."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from kinfmu.analysis import Report, check
from kinfmu.draw.scene.strokes import look
from kinfmu.mechanism import Mechanism, gallery
from kinfmu.mechanism.mechanism import require_mechanism
from kinfmu.mechanism.opened import opened
from kinfmu.page.describe import describe, module_data, written_file
from kinfmu.page.module import packed, page_module, require_page_size, solver

_WEB = Path(__file__).parent / "web"
_SCRIPTS = (
    "geometry",
    "numbers",
    "pen",
    "view",
    "engine",
    "cams",
    "forms",
    "ranges",
    "linkage",
    "instants",
    "names",
    "marks",
    "loads",
    "drawing",
    "design",
    "grips",
    "plots",
    "exports",
    "elements",
    "values",
    "panels",
    "motion",
    "transport",
    "hand",
    "main",
)
_EDITOR = tuple(
    f"editor{name}"
    for name in ("_places", "_tools", "_sketch", "_session", "_picture", "_panel", "_paint", "_hand", "_parts", "")
)
MOST_NUMBERS = 400  # of a file that its page can change: the code of more is too long for a small page
_IMPORT = re.compile(r"^import .*\n", re.MULTILINE)
_NAMES = re.compile(r'^import \{ (.*) \} from "\./(\w+)\.js";$', re.MULTILINE)
_EXPORT = re.compile(r"^export ", re.MULTILINE)
_COMMENT = re.compile(r"^ *//.*\n", re.MULTILINE)  # a line of its own
_INDENT = re.compile(r"^ +", re.MULTILINE)  # a tenth of a page; no text of the scripts goes over lines


def page(
    mechanism: Mechanism,
    *,
    report: Report | None = None,
    script: str = "",
    over: tuple[str, float, float] | None = None,
    samples: Mapping[str, Any] | None = None,
) -> str:
    """Return a page in which a mechanism is dragged: one HTML file that works offline, without any request.

    It computes with the solver of the native FMU and the formulas of its C code, as WebAssembly: as long as no number
    of the file but a parameter is changed, positions, velocities and accelerations equal those of the FMU to the bit.
    In pages of files with more than 400 numbers only parameters and laws can be changed, and the page states so.

    Args:
        mechanism: The mechanism.
        report: Its report, if `check` was called already. Default: `check` is called.
        over: A driver and its values from and to which the page shows the motion, in the file's unit or in radians.
            Default: the time of the run, and the whole range of a single driver.
        samples: Driver values that the page shows in place of the laws, as `samples_of` returns them. Default: none.
        script: JavaScript after that of the page, which `started.then((page) => ...)` calls. Default: none.

    Returns:
        The HTML text.

    Raises:
        KinfmuError: The mechanism cannot be solved.
        TooLargeError: It is too large for a page, such as one of more than 512 unknowns.

    """
    require_mechanism(mechanism, "page")
    return page_of(page_data(mechanism, report, over=over, samples=samples), script)


def page_data(
    mechanism: Mechanism,
    report: Report | None = None,
    *,
    over: tuple[str, float, float] | None = None,
    samples: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the data of the page of a mechanism, with the difference of its modules from the solver of all pages.

    Args:
        mechanism: The mechanism.
        report: Its report, as for `page`.
        over: A driver and its values, as for `page`.
        samples: Driver values, as for `page`.

    Raises:
        KinfmuError: The mechanism cannot be solved.
        TooLargeError: It is too large for a page.

    """
    require_page_size(mechanism)
    report = report or check(mechanism)
    if report.problem is not None and report.plan is None:
        raise report.problem
    as_written = page_module(mechanism, report=report)
    change = opened(mechanism)
    is_large = len(change.places) > MOST_NUMBERS
    places = {} if is_large else change.places
    modules = {
        "written": module_data(as_written, {}),
        "opened": module_data(page_module(change.mechanism, change.labels, report), places) if places else None,
    }
    drivers = [driver.name for driver in mechanism.drivers]
    data = describe(mechanism, report) | {
        "over": over and {"driver": drivers.index(over[0]), "from": over[1], "to": over[2]},
        "samples": samples,
        "size": as_written.plan.size,
        "modules": modules,
        "closedNumbers": len(change.places) if is_large else 0,
        "file": written_file(mechanism, as_written, places),
    }
    if samples:
        first, *_, last = samples["t"]
        data["run"] = {"from": first, "to": last, "step": (last - first) / (len(samples["t"]) - 1)}
    return data


def page_of(data: Mapping[str, Any], script: str = "") -> str:
    """Return the HTML text of a page.

    Args:
        data: What `page_data` returns; or a name and `modules` None, for a page that is drawn on by its script.
        script: JavaScript after that of the page. Default: none.

    """
    text = json.dumps({**data, "solver": solver(), "look": look()}, separators=(",", ":"), allow_nan=False)
    code = "\n".join([*(_script(name) for name in _SCRIPTS), f"{{\n{script}\n}}"])  # names of its own
    return _filled(
        (_WEB / "index.html").read_text("utf-8"),
        {
            "title": html.escape(str(data["name"])),
            "style": (_WEB / "style.css").read_text("utf-8"),
            "data": packed(text.encode()),
            "script": packed(code.encode()),
        },
    )


@cache
def gallery_page() -> str:
    """Return the page of a server that links the pages of the mechanisms of the gallery, gallery/NAME."""
    titles = {name: gallery.load(name).title for name in gallery.names()}
    cards = "\n".join(
        f'<a class="button" href="gallery/{name}"><b>{name}</b>{html.escape(title)}</a>'
        for name, title in titles.items()
    )
    text = (_WEB / "index.html").read_text("utf-8")
    head = _filled(text[: text.index("<body>")], {"title": "Gallery", "style": (_WEB / "style.css").read_text("utf-8")})
    header = (
        '<header><div class="name"><h1>Gallery</h1></div><a class="button" href=".">Back to the mechanism</a></header>'
    )
    dark = 'if (matchMedia("(prefers-color-scheme: dark)").matches) document.documentElement.dataset.theme = "dark";'
    return (
        f'{head}<body>\n<script>{dark}</script>\n{header}\n<main class="gallery">\n{cards}\n</main>\n</body>\n</html>\n'
    )


def editor_script() -> str:
    """Return the JavaScript with which a mechanism is drawn in a page, to be part of the script of `page_of`.

    It is EDITOR: packed text, which makes `window.kinfmuEditor` when it runs, and the names of the page that it needs.
    """
    modules = {name: (_WEB / f"{name}.js").read_text("utf-8") for name in _EDITOR}
    imports = [(names, source) for text in modules.values() for names, source in _NAMES.findall(text)]
    of_page = {name for found, source in imports if source not in modules for name in found.split(", ")}
    names = ", ".join(sorted(of_page))
    style = f"const EDITOR_STYLE = {json.dumps((_WEB / 'editor.css').read_text('utf-8'))};"
    code = "\n".join([style, *map(_script, modules), "return Editor;"])
    text = packed(f"window.kinfmuEditor = ({{ {names} }}) => {{\n{code}\n}};".encode())
    return f'const EDITOR = ["{text}", {{ {names} }}];\n'


@cache
def _script(name: str) -> str:
    """Return a module of web/ as a part of one script: without comments, indentation, imports, and the word export."""
    text = _COMMENT.sub("", (_WEB / f"{name}.js").read_text("utf-8"))
    return _INDENT.sub("", _EXPORT.sub("", _IMPORT.sub("", text)))


def _filled(text: str, values: Mapping[str, str]) -> str:
    """Return text with each {{name}} replaced once."""
    return re.sub(r"\{\{(\w+)\}\}", lambda found: values[found[1]], text)
