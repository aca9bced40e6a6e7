"""Formulas as SVG, drawn from LaTeX while the site builds: a page needs no script and no font for them."""

from __future__ import annotations

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
