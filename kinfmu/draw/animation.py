"""animate(): the linkage of a run as a GIF animation or, by the program ffmpeg, as an MP4 video."""

from __future__ import annotations

import contextlib
import io
import math
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kinfmu.arrays import FloatArray
from kinfmu.draw.drawing import draw, extent, placed
from kinfmu.draw.marks import gravity_in_margin, paths, pins
from kinfmu.draw.scene import palette
from kinfmu.draw.scene.dark import on_dark
from kinfmu.draw.scene.instant import Instant, directions
from kinfmu.draw.scene.placing import poses_of, remedy, world
from kinfmu.draw.scene.shapes import shapes
from kinfmu.draw.scene.strokes import Sizes, fineness, strokes_of
from kinfmu.draw.sheet import GREY, Sheet, ink
from kinfmu.draw.writing import check_suffix, figure_style, write_bytes
from kinfmu.errors import FigureError, MechanismError, MissingPackageError, listed
from kinfmu.files import suffix_of, temporary_folder
from kinfmu.mechanism import Mechanism
from kinfmu.mechanism.body import GROUND_NAME
from kinfmu.mechanism.quantities.placement import body_of
from kinfmu.run import Run
from kinfmu.run.axis import axis_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from PIL.Image import Image


SUFFIXES = (".gif", ".mp4")
DOTS_PER_INCH = 80.0  # about 600 pixels across
NARROWEST, LARGEST = 100, 1920  # [pixels]; smallest width, and longest side, since all pictures are kept in memory
SHORTEST, LONGEST = 3.0, 8.0  # [s], limits of the duration; between them it is the run's own time
PER_SECOND, MOST = 20.0, 100  # pictures; viewers of GIF round times to hundredths of a second
COLOURS = 32  # of the whole animation; more make the file larger without a visible difference
REST = 1.0  # [s] that the last picture is shown if the motion does not return to its start
_SAMPLES = 1000  # of the run, in a path
_CLOSED = 1e-3  # of a body's extent over the run; a motion whose end is so near to its start repeats
_TRAIL = 0.12  # of the pictures, length of a trail
_FARTHEST = 0.5 * math.pi  # [rad], largest rotation of a body from picture to picture
_LARGEST = 1e100  # largest position to draw: squares of larger ones are infinite
_WIDTHS = (1.3, 1.9, 2.6, 3.3)  # [pt] of a trail, along it


class _Size(NamedTuple):
    """Width of the pictures [pixels], None for the usual one; the file, for messages; True for a dark paper."""

    width: int | None
    path: Path
    is_dark: bool

    def dots_per_inch(self, inches: FloatArray) -> float:
        """Return the resolution of pictures whose width and height are `inches`."""
        if self.width is None:
            return DOTS_PER_INCH
        wide, high = map(float, inches)
        if max(self.width, round(self.width * high / wide)) > LARGEST:
            most = math.floor(LARGEST * min(wide / high, 1.0))
            size = f"{self.width} x {round(self.width * high / wide)}"
            raise FigureError(f"{self.path}: pictures of {size} pixels are too large; the width can be {most} at most")
        return (self.width + 1e-6) / wide  # matplotlib rounds down


class _Film(NamedTuple):
    """Samples to show in order, the duration, and whether the motion repeats."""

    rows: NDArray[np.int64]
    seconds: float
    repeats: bool


def animate(run: Run, path: str | Path, *, width: int | None = None, dark: bool = False) -> None:
    """Draw the moving linkage of `run` into a .gif or .mp4 file: bodies, joints, cams, wheels, paths, trails.

    The animation takes the run's own time, but at least SHORTEST and at most LONGEST; LONGEST if the run has no time. A
    motion that ends where it began repeats without a pause. Samples without numbers show the last pose that closed,
    with a notice. The same run gives the same bytes with the same versions of matplotlib and Pillow.

    Args:
        run: The run.
        path: The .gif or .mp4 file.
        width: Of the pictures [pixels], 100 or more; no side may be longer than 1920. A video has an even width and
            height, rounded up. Default: 80 pixels per inch, about 600.
        dark: True for light lines on a dark paper, for dark pages. Default: a white paper.

    Raises:
        FigureError: The width is out of range; the run has no mechanism, not all its coordinates, fewer than two
            samples with numbers, or too many turns for the number of pictures; or the file cannot be written.
        MissingPackageError: matplotlib is not installed or, for .mp4, ffmpeg is not.

    """
    path = Path(path)
    check_suffix(path, SUFFIXES, "animations")
    if width is not None and (isinstance(width, bool) or not isinstance(width, int) or width < NARROWEST):
        raise FigureError(f"{path}: width {width!r} must be a whole number of pixels, {NARROWEST} or more")
    is_video = suffix_of(path) == ".mp4"
    if is_video:
        encoder(path)  # reports a missing program before the pictures are drawn
    mechanism, poses = placed_run(run, path)
    film = _film(run, poses, path)
    with figure_style(path):
        images = list(_images(run, mechanism, poses, film, _Size(width, path, dark)))
    own = [on_dark(colour) if dark else colour for colour in _colours(mechanism, poses)]
    write_bytes(path, mp4(images, film.seconds, path) if is_video else _gif(images, film, own))


def _colours(mechanism: Mechanism, poses: dict[str, FloatArray]) -> list[palette.Colour]:
    """Return colours that a picture of few colours keeps as they are: of paper, loads, and most bodies."""
    shown = Instant(mechanism, {body: pose[:1] for body, pose in poses.items()}, {})
    painted = sorted(strokes_of(shapes(shown), Sizes(1.0, 1.0)), key=lambda one: not one.shape.is_effort)
    found = [palette.WHITE, palette.DRIVER, *(colour for one in painted for colour in one.colours() if colour)]
    return list(dict.fromkeys(found))[: COLOURS // 2]


def placed_run(run: Run, path: Path) -> tuple[Mechanism, dict[str, FloatArray]]:
    """Return the run's mechanism, and poses (n, 3) by body and for the ground; gaps hold the pose before them."""
    try:
        mechanism = run.mechanism
    except MechanismError as error:
        raise FigureError(f"{path}: {error}") from None
    if mechanism is None:
        raise FigureError(f"{path}: the run does not hold its mechanism, so there is nothing to draw")
    poses, missing = poses_of(run, mechanism)
    if missing:
        names = [name for columns in missing.values() for name in columns]
        raise FigureError(
            f"{path}: the run does not hold {listed(names)}, without which the linkage cannot be drawn; "
            f"{remedy(run, names)}"
        )
    last = np.maximum.accumulate(np.where(run.good, np.arange(len(run)), 0))  # the last sample with numbers
    held = {body: pose[last] for body, pose in poses.items()}
    for body, pose in held.items():
        if not (np.abs(pose[run.good]) < _LARGEST).all():
            raise FigureError(f"{path}: the run holds poses of '{body}' that are not numbers or too large to draw")
    return mechanism, held | {GROUND_NAME: np.zeros((len(run), 3))}


def _film(run: Run, poses: dict[str, FloatArray], path: Path) -> _Film:
    good = np.flatnonzero(run.good)
    if len(good) < 2:
        raise FigureError(f"{path}: an animation needs two samples with numbers; the run has {len(good)}")
    axis = axis_of(run)
    t = np.abs(axis.values[good[0] :] - axis.values[good[0]])
    seconds = float(np.clip(t[-1], SHORTEST, LONGEST)) if axis.is_time else LONGEST
    times = np.linspace(0.0, t[-1], min(round(PER_SECOND * seconds), MOST) + 1)
    rows = good[0] + np.unique(np.searchsorted(t, times, side="right") - 1)
    if len(rows) < len(t):
        _check_seen(run, poses, rows, path)
    repeats = bool(run.good[[rows[0], rows[-1]]].all()) and all(_comes_back(pose[rows]) for pose in poses.values())
    return _Film(rows[:-1] if repeats else rows, seconds, repeats)


def _check_seen(run: Run, poses: dict[str, FloatArray], rows: NDArray[np.int64], path: Path) -> None:
    """Raise a FigureError if a body turns so far from picture to picture that its direction is not visible."""
    steps = {body: float(np.abs(np.diff(pose[rows, 2])).max()) for body, pose in poses.items()}
    body = max(steps, key=lambda name: steps[name])
    if steps[body] > _FARTHEST:
        axis = axis_of(run)
        part = float(np.ptp(axis.values[rows])) * _FARTHEST / steps[body]
        raise FigureError(
            f"{path}: '{body}' turns by {math.degrees(steps[body]):.0f} deg from one of {len(rows)} pictures to the "
            f"next, so that its motion would not be seen; choose a part of the run, no longer than {part:.3g} "
            f"{axis.unit or 'samples'}"
        )


def _comes_back(pose: FloatArray) -> bool:
    """Return True if a body (n, 3) ends where it began, up to whole turns."""
    first, last = pose[0], pose[-1]
    extent = np.hypot(*np.ptp(pose[:, :2], axis=0))
    turn = (last[2] - first[2] + np.pi) % (2.0 * np.pi) - np.pi
    return bool(np.hypot(*(last - first)[:2]) <= _CLOSED * extent and abs(turn) <= _CLOSED * np.ptp(pose[:, 2]))


def _images(run: Run, mechanism: Mechanism, poses: dict[str, FloatArray], film: _Film, size: _Size) -> Iterator[Image]:
    """Yield the pictures in order, all of one size."""
    some = slice(None, None, max(-(-len(run) // _SAMPLES), 1))
    start, ways = int(film.rows[0]), directions(run, mechanism)
    whole = Instant(mechanism, {body: np.vstack([pose[start], pose[some]]) for body, pose in poses.items()}, ways)
    found, tracks = shapes(whole), paths(whole)  # for all pictures; the frames of the shapes move
    scenes = []
    for row in film.rows.tolist():
        shown = Instant(mechanism, {body: pose[row : row + 1] for body, pose in poses.items()}, ways)
        scenes.append((placed(shown, found), pins(shown)))
    extents = [part for drawn, places in scenes for part in (extent(drawn), *(mark.extent() for mark in places))]
    reach = np.vstack([*extents, *(track.extent() for track in tracks)])
    fine = fineness(scenes[0][0], float(np.ptp(reach, axis=0).max()))
    back = max(round(_TRAIL * len(film.rows)), 1)
    for k, (row, (drawn, places)) in enumerate(zip(film.rows, scenes, strict=True)):
        sheet = Sheet(reach, fine, None, mechanism.title or mechanism.name)
        begun = k - back if k >= back else (k - back + len(film.rows) if film.repeats else 0)
        draw(sheet, drawn, tracks, places)
        _trails(sheet, run, mechanism, poses, (int(film.rows[begun]), int(row)))
        gravity_in_margin(sheet, mechanism)
        _clock(sheet, run, int(row))
        if size.is_dark:
            _darken(sheet.figure)
        yield _picture(sheet, size.dots_per_inch(sheet.figure.get_size_inches()))


def _trails(sheet: Sheet, run: Run, mechanism: Mechanism, poses: dict[str, FloatArray], ends: tuple[int, int]) -> None:
    """Draw trails of the points of interest, wider towards the present."""
    first, last = ends
    rows = np.arange(first, last + 1) if first <= last else np.r_[first : len(run), 0 : last + 1]
    bodies = len(mechanism.moving_bodies)
    for index, name in enumerate(mechanism.points.values()):
        track = world(poses[body_of(name)][rows], mechanism.body_points[name])
        track[~run.good[rows]] = np.nan
        for piece, width in zip(np.array_split(np.arange(len(track)), len(_WIDTHS)), _WIDTHS, strict=True):
            if len(piece):
                sheet.track(track[max(piece[0] - 1, 0) : piece[-1] + 1], width, palette.body(bodies + index))


def _clock(sheet: Sheet, run: Run, row: int) -> None:
    """Draw the time, and a notice if the run has no numbers then."""
    axis = axis_of(run)
    digits = max(2 - math.floor(math.log10(float(np.ptp(axis.values)))), 0)
    name = "" if axis.is_time else f"{axis.name}{' =' if axis.unit else ''} "
    text, colour = f"{name}{axis.values[row]:.{digits}f} {axis.unit}".rstrip(), GREY
    if not run.good[row]:
        text, colour = f"no pose at {text}: the last one that closed", palette.DRIVER
    sheet.axes.text(
        1.0, 0.0, text, fontsize=9.0, ha="right", va="bottom", transform=sheet.axes.transAxes, color=ink(colour)
    )


def _darken(figure: Figure) -> None:
    """Give everything in a figure its colours on dark paper."""
    from matplotlib.colors import to_rgba
    from matplotlib.patches import Patch

    for artist in figure.findobj(lambda one: hasattr(one, "get_color") or isinstance(one, Patch)):
        for key in ("facecolor", "edgecolor") if isinstance(artist, Patch) else ("color",):
            *rgb, alpha = to_rgba(getattr(artist, f"get_{key}")())
            red, green, blue = (round(255.0 * value) for value in rgb)
            getattr(artist, f"set_{key}")((*ink(on_dark((red, green, blue), is_area=key == "facecolor")), alpha))


def _picture(sheet: Sheet, dots_per_inch: float) -> Image:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    sheet.figure.set_dpi(dots_per_inch)
    canvas = FigureCanvasAgg(sheet.figure)
    canvas.draw()  # type: ignore[no-untyped-call]  # matplotlib has no types here
    return Image.fromarray(np.asarray(canvas.buffer_rgba())[:, :, :3].copy())  # type: ignore[no-untyped-call]


def _gif(images: Sequence[Image], film: _Film, own: Sequence[palette.Colour]) -> bytes:
    """Return the pictures as a GIF with their COLOURS most important colours, without dithering.

    own: colours that are kept as they are; quantizing would mix them with others.
    """
    from PIL import Image

    width, height = images[0].size
    some = images[:: max(len(images) // 8, 1)]
    together = Image.new("RGB", (width, height * len(some)))
    for k, image in enumerate(some):
        together.paste(image, (0, k * height))
    mixed = together.quantize(COLOURS - len(own), method=Image.Quantize.MEDIANCUT).getpalette() or []
    colours = np.vstack([own, np.reshape(mixed, (-1, 3))])[:COLOURS]
    nearest = _nearest(colours)
    flat = []
    for image in images:
        coarse = np.asarray(image, int) >> 3
        flat.append(Image.fromarray(nearest[coarse[:, :, 0], coarse[:, :, 1], coarse[:, :, 2]]))
        flat[-1].putpalette(colours.ravel().tolist())
    each = round(100.0 * film.seconds / (len(flat) - (not film.repeats))) * 10  # [ms]
    times = [each] * len(flat)
    if not film.repeats:
        times[-1] += round(1000.0 * REST)
    file = io.BytesIO()
    flat[0].save(file, "GIF", save_all=True, append_images=flat[1:], duration=times, loop=0)
    return file.getvalue()


def _nearest(colours: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return the index of the nearest of some colours (k, 3) for 32 shades of red, green and blue, (32, 32, 32)."""
    shades = np.arange(32) * 255 // 31
    red, green, blue = np.meshgrid(shades, shades, shades, indexing="ij")
    apart = sum((part[..., None] - colours[:, k]) ** 2 for k, part in enumerate((red, green, blue)))
    return np.asarray(np.argmin(apart, axis=-1), np.uint8)


def encoder(path: Path) -> str:
    """Return the path of ffmpeg; MissingPackageError about `path` if it is not installed."""
    found = shutil.which("ffmpeg")
    if found is None:
        raise MissingPackageError(
            f"{path}: an MP4 needs the program ffmpeg, which is not found; install it (Debian, Ubuntu: apt-get "
            "install ffmpeg), or write a .gif"
        )
    return found


def mp4(images: Sequence[Image], seconds: float, path: Path) -> bytes:
    """Return pictures of one size as an MP4 (H.264) that lasts `seconds`; FigureError if ffmpeg fails.

    The size is rounded up to even numbers of pixels, which the format needs. Equal pictures give equal bytes with the
    same version of ffmpeg.
    """
    width, height = images[0].size
    with temporary_folder() as folder:
        made = folder / "video.mp4"
        command = [
            encoder(path), "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}",
            "-r", f"{len(images) / seconds:.6f}", "-i", "-", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white",
            "-c:v", "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-fflags", "+bitexact", str(made),
        ]  # fmt: skip
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as running:  # noqa: S603  of the PATH
            if running.stdin:
                with contextlib.suppress(OSError):  # it ended early, and states why
                    for image in images:
                        running.stdin.write(image.tobytes())
            _, errors = running.communicate()
        if running.returncode or not made.exists():
            *_, why = ["no reason given", *errors.decode(errors="replace").split("\n")[:1]]
            raise FigureError(f"{path}: ffmpeg failed: {why or 'no reason given'}")
        return made.read_bytes()
