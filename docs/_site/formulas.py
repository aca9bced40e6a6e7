"""Formulas as SVG, drawn from LaTeX while the site builds: a page needs no script and no font for them."""

from __future__ import annotations

import re
from html import escape
from typing import Any

from docutils import nodes

SIZE = 17  # [px] of letters; the text around has 16


def connect(app: Any) -> None:
    """Give Sphinx the renderer 'drawn'."""
    app.add_html_math_renderer("drawn", (_inline, None), (_display, None))


def _inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(_svg(node.astext()))
    raise nodes.SkipNode


def _display(translator: Any, node: nodes.math_block) -> None:
    translator.body.append(f'<div class="formula">{_svg(node.astext(), display=True)}</div>\n')
    raise nodes.SkipNode


def _svg(latex: str, *, display: bool = False) -> str:
    """Return the formula as an element in the colour of the text, on its baseline, with its LaTeX for readers aloud."""
    import ziamath

    ziamath.config.svg2 = False  # paths in place of symbols, whose ids would repeat in a page
    drawn = ziamath.Latex(latex, size=SIZE, inline=not display, color="currentColor")
    _, descent = drawn.getyofst(), drawn.getyofst()
    style = "" if display else f' style="vertical-align: {descent:.2f}px"'
    return drawn.svg().replace("<svg ", f'<svg role="img" aria-label="{escape(latex)}"{style} ', 1)


# ----------------------------------------------------------------------------------------------- formulas of docstrings


_WORDS = re.compile(
    r"(?<![\w`])(along|or the same with y|up to|then mirrored|continuous|angle of \w in the cam's frame)"
)
_NOTE = re.compile(r" {2,}\(([^()]*)\)$")  # such as (2 rows, scale 1)
_TOKEN = re.compile(r"\\text\{[^}]*\}|[A-Za-z][A-Za-z_]*(?:\d|\{k\+1\})?|\d+|\.\.\.|\S| ")
_KNOWN = {
    "phi": r"\varphi",
    "Phi": r"\Phi",
    "pi": r"\pi",
    "sin": r"\sin",
    "cos": r"\cos",
    "sum": r"\sum",
    "...": r"\dots",
}


def latex(line: str) -> str:
    """Return a formula of a docstring, such as `Phi = d.d - L^2    (1 row)`, as LaTeX."""
    note = _NOTE.search(line)
    text = line[: note.start()] if note else line
    text = _WORDS.sub(r"\\text{\1}", text).replace("ds/dt", "dsdt").replace("_k+1", "_{k+1}")
    text = re.sub(r"(?<=\b[a-z])\.(?=[a-z]\b)", "@", text)
    parts = [_math(part) for part in re.split(r" {2,}", text.strip())]
    return r" \quad ".join([*parts, *([rf"\text{{({note[1].replace('`', '')})}}"] if note else [])])


def _math(text: str) -> str:
    """Return a formula with its names as LaTeX; a blank between two factors stays visible."""
    made = ""
    last, was_blank = "", False
    for sign in _TOKEN.findall(text):
        if sign == " ":
            was_blank = True
            continue
        is_factor = sign[0].isalnum() or sign[0] in "(\\|"
        if was_blank and is_factor and (last[-1:].isalnum() or last[-1:] in ")}|'"):
            made += r"\, "
        made += _name(sign)
        last, was_blank = sign, False
    return re.sub(r"\[(.*?)\]", _column, made)


def _column(found: re.Match[str]) -> str:
    rows = found[1].replace(";", r" \\ ")
    return rf"\begin{{bmatrix}} {rows} \end{{bmatrix}}" if rows != found[1] else found[0]


def _name(sign: str) -> str:
    """Return a name or sign as LaTeX: letters with indices as they are, names of keys upright."""
    if sign == "dsdt":
        return r"\dot s "
    if sign == "@":
        return r" \cdot "
    base, _, index = sign.partition("_")
    if sign in _KNOWN or (base in _KNOWN and index):
        return _KNOWN[base] + (f"_{{{index}}}" if index else " ")
    if len(base) == 1 and base.isalpha():
        return f"{base}_{{{index}}}" if index else base
    if re.fullmatch(r"[a-z]\d", sign):
        return f"{sign[0]}_{sign[1]}"
    if index in ("1", "k", "{k+1}"):
        return rf"\mathrm{{{base}}}_{index}"
    if sign[0].isalpha():
        return rf"\mathrm{{{sign.replace('_', chr(92) + '_')}}}"
    return sign
