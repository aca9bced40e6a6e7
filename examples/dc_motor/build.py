"""Build the FMUs of the example, dc_motor.fmu and toggle_press.fmu, and press_drive.ssp, which connects them.

python examples/dc_motor/build.py [FOLDER]         # default: this folder
"""

from __future__ import annotations

import sys
import zipfile
from pathlib import Path

import kinfmu
from kinfmu.codegen.c.compiler import shared_library_bytes
from kinfmu.fmu.archive import digest, token, zipped
from kinfmu.fmu.native.platforms import host
from kinfmu.fmu.native.sources import headers

HERE = Path(__file__).parent


def motor(folder: Path) -> Path:
    """Compile the motor for this platform and return its FMU."""
    code, xml = ((HERE / name).read_text("utf-8") for name in ("dc_motor.c", "modelDescription.xml"))
    guid = token(digest({"dc_motor.c": code.encode(), "modelDescription.xml": xml.encode()}))
    code = f'#define TOKEN "{guid}"\n{code}'
    library = shared_library_bytes({"dc_motor.c": code} | headers("2.0"), ["-O2", "-fvisibility=hidden"])
    platform = host()
    path = folder / "dc_motor.fmu"
    path.write_bytes(
        zipped(
            {
                "modelDescription.xml": xml.replace("@TOKEN@", guid).encode(),
                "sources/dc_motor.c": code.encode(),
                f"binaries/{platform.folder('2.0')}/dc_motor{platform.suffix}": library,
            }
        )
    )
    return path


def build(folder: Path) -> dict[str, Path]:
    """Build both FMUs and the SSP into a folder and return their paths by name."""
    folder.mkdir(parents=True, exist_ok=True)
    press = kinfmu.build(kinfmu.load("toggle_press"), folder / "toggle_press.fmu", flavour="native", drive="inputs")
    made = {"dc_motor": motor(folder), "toggle_press": press, "press_drive": folder / "press_drive.ssp"}
    with zipfile.ZipFile(made["press_drive"], "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(HERE / "SystemStructure.ssd", "SystemStructure.ssd")
        archive.write(HERE / "motor.ssv", "resources/motor.ssv")
        for name in ("dc_motor", "toggle_press"):
            archive.write(made[name], f"resources/{name}.fmu")
    return made


if __name__ == "__main__":
    for path in build(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE).values():
        print(path)
