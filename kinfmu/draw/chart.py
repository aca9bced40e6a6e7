"""Style of charts: axes with a grid, and names next to their curves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from kinfmu.arrays import FloatArray
from kinfmu.draw.scene.palette import Colour
from kinfmu.draw.sheet import FONT, GREY, INK, ink

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LIGHT: Colour = (228, 228, 228)
SMALL = 8.0  # [pt]
_PLAIN = (-2, 5)  # powers of ten of the largest number from which and below which axes have plain numbers
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Look(NamedTuple):
    """Style of the curves of one engine."""

    colour: Colour
    width: float = 1.4  # [pt]
    marker: str = "o"


def dress(axes: Axes, title: str) -> None:
    """Give axes grey scales, a faint grid and no frame."""
    grey = ink(GREY)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_linewidth(0.6)
        spine.set_color(grey)
    axes.tick_params(labelsize=SMALL, length=3.0, width=0.6, color=grey, labelcolor=grey)
    axes.tick_params(which="minor", length=0.0)
    axes.grid(visible=True, which="major", linewidth=0.5, color=ink(LIGHT))
    axes.set_axisbelow(True)
    axes.set_title(title, fontsize=FONT + 1.0, loc="left", color=ink(INK), parse_math=False)


def powers_of_ten(axes: Axes, values: FloatArray) -> None:
    """Give axes a vertical scale of whole powers of ten around positive values."""
    known = values[np.isfinite(values)]
    axes.set_yscale("log")
    if len(known):
        low, high = np.floor(np.log10(known.min())), np.ceil(np.log10(known.max()))
        axes.set_ylim(10.0**low, 10.0 ** max(high, low + 1.0))
    axes.yaxis.set_minor_formatter(lambda *_: "")


def numbers(axes: Axes, unit: str) -> str:
    """Give a vertical axis plain numbers, and return their unit: with a power of ten if they are tiny or huge."""
    size = float(np.abs(axes.get_ylim()).max())
    power = int(np.floor(np.log10(size))) if size > 0.0 else 0
    power = 0 if _PLAIN[0] <= power < _PLAIN[1] else 3 * (power // 3)

    def text(value: float, _: object = None) -> str:
        ticks = np.asarray(axes.yaxis.get_majorticklocs()) / 10.0**power
        step = float(np.diff(ticks).max(initial=0.0))
        digits = next((d for d in range(15) if (np.abs(ticks.round(d) - ticks) <= 1e-6 * step).all()), 15)
        shown = f"{round(value / 10.0**power, digits) + 0.0:.{digits}f}"
        return (shown.rstrip("0").rstrip(".") if digits else shown).replace("-", "\N{MINUS SIGN}")

    axes.yaxis.set_major_formatter(text)
    return unit if power == 0 else f"10{str(power).translate(_RAISED)} {'' if unit == '1' else unit}".rstrip()


def named(axes: Axes, at: tuple[float, float], text: str, colour: Colour, **where: Any) -> None:
    """Write a name next to its curve, in its colour, on a white background."""
    axes.annotate(
        text,
        at,
        xytext=where.pop("offset", (0.0, 0.0)),
        textcoords="offset points",
        color=ink(colour),
        fontsize=SMALL,
        parse_math=False,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.8},
        zorder=10.0,
        **where,
    )
