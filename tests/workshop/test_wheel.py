"""What is installed with the package besides its modules."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from kinfmu import gallery

CHECKOUT = Path(__file__).parents[2]


def test_the_gallery_is_installed_with_the_references_that_bench_measures_by(tmp_path: Path) -> None:
    pytest.importorskip("setuptools", reason="comes with pip, mostly")
    shutil.copytree(CHECKOUT / "fmus", tmp_path / "fmus", ignore=shutil.ignore_patterns("*.fmu", "*.svg"))
    shutil.copy(CHECKOUT / "setup.py", tmp_path)
    (tmp_path / "kinfmu").mkdir()
    (tmp_path / "kinfmu" / "__init__.py").touch()
    (tmp_path / "setup.cfg").write_text("[metadata]\nname = kinfmu\n[options]\npackages = kinfmu\n", encoding="utf-8")
    build = [sys.executable, "setup.py", "-q", "build_py", "--build-lib", "built"]
    subprocess.run(build, cwd=tmp_path, check=True, capture_output=True)
    installed = tmp_path / "built" / "kinfmu" / "fmus"
    assert sorted(path.name for path in installed.iterdir()) == gallery.names()
    for folder in installed.iterdir():
        assert sorted(path.name for path in folder.iterdir()) == ["mechanism.toml", "reference.csv"]
