"""The figures in the gallery show what those drawn now show: the same shapes and texts at the same places."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from kinfmu.draw import figure
from kinfmu.mechanism import gallery
from tests.draw.picture import differences, picture
from tests.gallery_members import every_member
from tests.mechanism.loads.every_load import every_load
from tests.mechanisms import fourbar

DOCS = Path(__file__).parents[2] / "docs"


@every_member
def test_the_figure_in_the_gallery_is_current(name: str, gallery_figure: Callable[[str], Path]) -> None:
    there, now = picture(gallery.folder() / name / "figure.svg"), picture(gallery_figure(name))
    assert not differences(there, now), "scripts/pictures draws it anew"


def test_the_figure_of_every_load_in_the_docs_is_current(tmp_path: Path) -> None:
    figure(every_load(), tmp_path / "now.svg")
    there, now = picture(DOCS / "loads.svg"), picture(tmp_path / "now.svg")
    assert not differences(there, now), "scripts/pictures draws it anew"


def test_pictures_of_two_mechanisms_differ_in_shapes_and_texts(tmp_path: Path) -> None:
    figure(fourbar(4.0, 1.0, 3.5, 3.0), tmp_path / "one.svg")
    figure(fourbar(4.0, 1.0, 3.5, 3.2), tmp_path / "other.svg")
    one, other = picture(tmp_path / "one.svg"), picture(tmp_path / "other.svg")
    assert {line.partition(" ")[0].strip(":") for line in differences(one, other)} >= {"shape", "text"}
    assert {"crank", "coupler", "rocker"} <= {text.look.split("'")[1] for text in one.texts}
    assert any(np.ptp(shape.points, axis=0).max() > 100.0 for shape in one.shapes)
    assert not differences(one, one)
