"""Writing a figure of matplotlib into a file: the same picture on every computer, whatever its settings are."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from kinfmu.draw.scene.dark import with_dark_colours
from kinfmu.errors import FigureError, MissingPackageError, listed
from kinfmu.files import errors_of_writing, suffix_of, write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".svg", ".png", ".pdf")
DOTS_PER_INCH = 150  # of a PNG
_NEEDS_MATPLOTLIB = "drawing needs matplotlib: pip install 'kinfmu[figures]'"


def check_target(function: str, path: object, ax: object) -> None:
    """Raise a FigureError unless a call names either a file or matplotlib Axes with two linear scales.

    MissingPackageError without matplotlib.
    """
    if (path is None) == (ax is None):
        raise FigureError(f"{function} needs a path, or Axes of matplotlib as ax=; give one of both")
    if ax is None:
        return
    try:
        from matplotlib.axes import Axes
    except ImportError:
        raise MissingPackageError(f"{function}: {_NEEDS_MATPLOTLIB}") from None
    if not isinstance(ax, Axes):
        raise FigureError(f"ax must be Axes of matplotlib, such as plt.subplots()[1], not {type(ax).__name__}")
    if ax.name != "rectilinear":
        raise FigureError(f"ax must be Axes with x and y, not with the projection '{ax.name}'")


def write(paths: Path | tuple[Path, ...], draw: Callable[[], Figure]) -> None:
    """Write the figure of `draw` into one or several .svg, .png or .pdf files; equal figures give equal bytes.

    FigureError for another suffix or a file that cannot be written, MissingPackageError without matplotlib.
    """
    paths = paths if isinstance(paths, tuple) else (paths,)
    for path in paths:
        check_suffix(path)
    with figure_style(paths[0]):
        figure = draw()
        images = [_image(figure, suffix_of(path)) for path in paths]
    for path, image in zip(paths, images, strict=True):
        write_bytes(path, image)


def write_pdf(path: Path, draw: Callable[[], Sequence[Figure]]) -> None:
    """Write the figures of `draw` as pages of a PDF; errors as in `write`."""
    with figure_style(path):
        from matplotlib.backends.backend_pdf import PdfPages

        file = io.BytesIO()
        with PdfPages(file, metadata={"CreationDate": None}) as pages:
            for figure in draw():
                pages.savefig(figure)
    write_bytes(path, file.getvalue())


def svg_text(subject: str, draw: Callable[[], Figure]) -> str:
    """Return the figure of `draw` as SVG; MissingPackageError about `subject` without matplotlib."""
    with figure_style(subject):
        return _image(draw(), ".svg").decode()


@contextmanager
def figure_style(subject: object) -> Iterator[None]:
    """Apply kinfmu's style instead of the user's settings; MissingPackageError about `subject` without matplotlib."""
    try:
        import matplotlib as mpl
    except ImportError:
        raise MissingPackageError(f"{subject}: {_NEEDS_MATPLOTLIB}") from None
    with mpl.rc_context(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=r"Glyph .* missing from font")  # a frame is drawn instead
        mpl.rcdefaults()
        mpl.rcParams["svg.fonttype"] = "none"  # text as text
        mpl.rcParams["svg.hashsalt"] = "kinfmu"  # the same identifiers every time
        mpl.rcParams["pdf.fonttype"] = 42  # letters as outlines that programs can edit and search
        mpl.rcParams["font.family"] = ["DejaVu Sans"]  # comes with matplotlib
        yield


def write_bytes(path: Path, image: bytes) -> None:
    """Write a picture; FigureError if the file cannot be written."""
    with errors_of_writing(path, FigureError):
        write_whole(path, image)


def check_suffix(path: Path, known: Sequence[str] = SUFFIXES, what: str = "figures") -> None:
    """Raise a FigureError unless the suffix of a file is a known format; what: is written there, in messages."""
    if suffix_of(path) not in known:
        raise FigureError(f"{path}: '{path.suffix}' is not a known format of {what}; known: {listed(known)}")


def _image(figure: Figure, suffix: str) -> bytes:
    """Return a figure as the bytes of a file."""
    file = io.BytesIO()
    if suffix == ".svg":
        figure.savefig(file, format="svg", metadata={"Date": None}, transparent=True)
        return with_dark_colours(file.getvalue().decode()).encode()
    if suffix == ".pdf":
        figure.savefig(file, format="pdf", metadata={"CreationDate": None})
    else:
        figure.savefig(file, format="png", dpi=DOTS_PER_INCH)
    return file.getvalue()
