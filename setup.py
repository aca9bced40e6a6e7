"""Ships the gallery, which lies in fmus/ next to the package, inside the wheel as kinfmu/fmus."""

from pathlib import Path
from shutil import copyfile

from setuptools import setup
from setuptools.command.build_py import build_py

GALLERY = Path("fmus")
SHIPPED = ("mechanism.toml", "reference.csv")


class BuildWithGallery(build_py):
    """Also copies the mechanisms, and their references, by which `scripts/bench` measures errors."""

    def run(self):
        super().run()
        if self.editable_mode:
            return
        for source in sorted(path for name in SHIPPED for path in GALLERY.glob(f"*/{name}")):
            target = Path(self.build_lib) / "kinfmu" / source
            target.parent.mkdir(parents=True, exist_ok=True)
            copyfile(source, target)


setup(cmdclass={"build_py": BuildWithGallery})
