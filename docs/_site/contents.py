"""Check a built site: each page of the gallery has its live page, FMU and files, and these are of its mechanism.

PYTHONPATH=docs python -m _site.contents docs/_build
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from urllib.parse import unquote

from fmpy import read_model_description

from _site.links import Page
from kinfmu.mechanism import gallery

FILES = ("mechanism.toml", "reference.csv", "figure.svg")  # copies of those in the mechanism's folder


def problems(site: Path, names: Sequence[str]) -> list[str]:
    """Return one line for each link that a page of the gallery lacks or whose target is not what the page says."""
    return [f"gallery/{name}.html: {text}" for name in names for text in _of(site / "gallery" / f"{name}.html", name)]


def _of(path: Path, name: str) -> Iterator[str]:
    if not path.is_file():
        yield "there is no such page"
        return
    page = Page(path)
    live, fmu = f"live/{name}.html", f"live/{name}.fmu"
    for link, there in ((live, page.loads), (live, page.links), (fmu, page.links)):
        if link not in there:
            yield f"no link to {link}"
    if live in page.links and f"<title>{name}</title>" not in (path.parent / live).read_text(encoding="utf-8"):
        yield f"{live} is not the page of {name}"
    if fmu in page.links and (found := read_model_description(path.parent / fmu).modelName) != name:
        yield f"{fmu} is an FMU of {found}"
    for file in FILES:
        links = [link for link in page.links if link.endswith(f"/{file}")]
        if not links:
            yield f"no link to {file}"
        for link in links:
            if (path.parent / unquote(link)).read_bytes() != (gallery.folder() / name / file).read_bytes():
                yield f"{link} is not {file} of {name}"


def main(site: Path) -> int:
    """Print what is wrong; return 1 if anything is."""
    found = problems(site, gallery.names())
    for line in found:
        print(line, file=sys.stderr)
    print(f"{len(found)} problems of the gallery" if found else "The gallery's pages have their files", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
