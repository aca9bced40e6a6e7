"""What is installed with the package besides its modules."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from kinfmu.mechanism import gallery

CHECKOUT = Path(__file__).parents[2]
TYPED = ("py.typed", "__init__.pyi")


def test_the_gallery_its_references_and_the_types_are_installed(tmp_path: Path) -> None:
    pytest.importorskip("setuptools", reason="comes with pip, mostly")
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))
    data = project["tool"]["setuptools"]["package-data"]["kinfmu"]
    shutil.copytree(CHECKOUT / "fmus", tmp_path / "fmus", ignore=shutil.ignore_patterns("*.fmu", "*.svg"))
    shutil.copy(CHECKOUT / "setup.py", tmp_path)
    (tmp_path / "kinfmu").mkdir()
    (tmp_path / "kinfmu" / "__init__.py").touch()
    for name in TYPED:
        shutil.copy(CHECKOUT / "kinfmu" / name, tmp_path / "kinfmu")
    (tmp_path / "setup.cfg").write_text(
        "[metadata]\nname = kinfmu\n[options]\npackages = kinfmu\n"
        f"[options.package_data]\nkinfmu = {', '.join(data)}\n",
        encoding="utf-8",
    )
    build = [sys.executable, "setup.py", "-q", "build_py", "--build-lib", "built"]
    subprocess.run(build, cwd=tmp_path, check=True, capture_output=True)
    for name in TYPED:
        assert (tmp_path / "built" / "kinfmu" / name).is_file()
    installed = tmp_path / "built" / "kinfmu" / "fmus"
    assert sorted(path.name for path in installed.iterdir()) == gallery.names()
    for folder in installed.iterdir():
        assert sorted(path.name for path in folder.iterdir()) == ["mechanism.toml", "reference.csv"]
