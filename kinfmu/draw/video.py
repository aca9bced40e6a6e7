"""Pictures as an MP4 video, by the program ffmpeg."""

from __future__ import annotations

import contextlib
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from kinfmu.errors import FigureError, MissingPackageError
from kinfmu.files import temporary_folder

if TYPE_CHECKING:
    from PIL.Image import Image


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
