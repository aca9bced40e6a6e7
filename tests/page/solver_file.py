"""The solver of pages as a file: compiled from the C of the solver by zig, with a hash of its sources in it.

What a model defines, its tables and its functions, is there as a place of the largest size, which kinfmu/page/module.py
fills. Run as a program, this module writes the file.
"""

from __future__ import annotations

import hashlib
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from kinfmu.codegen.c import compiler
from kinfmu.codegen.c.model import constants
from kinfmu.codegen.wasm.binary import custom_section
from kinfmu.page.module import EXPORTS, SOURCES

FILE = SOURCES / "solver.wasm"
SECTION = "sources"  # of the file: their hash
COMMAND = (
    sys.executable,
    "-m",
    "ziglang",
    "cc",
    "-target",
    "wasm32-wasi",
    "-mexec-model=reactor",
    "-Wno-static-in-inline",
)
FLAGS = ("-std=c99", "-Oz", "-ffp-contract=off", "-s", "-Wl,-z,stack-size=2097152")
CALLED = (  # by models; others are exported in called.c
    "kf_curve_at", "kf_lu", "kf_lu_solve", "kf_qr", "kf_qr_solve", "kf_solutions",
    "kf_row_part", "kf_column_part", "kf_unclosed",
)  # fmt: skip
UNSIZED = "32"  # bytes for a text, with the 0 at its end
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_TABLE = re.compile(r"^extern const ([^;]+?) (\w+(?:\[[^;]*\])?(?:, \w+)*);", re.MULTILINE)
_FUNCTION = re.compile(r"^(void|bool|int) (kf_\w+)\(([^;]*)\);", re.MULTILINE)


def sources() -> dict[str, str]:
    """Return the C files by name, without comments; page_sizes.h is there in place of a generated sizes.h."""
    files = compiler.sources([*compiler.SOLVER, "follower.h", "follower.c", "solutions.c"])
    files |= {path.name.removeprefix("page_"): path.read_text("utf-8") for path in sorted(SOURCES.glob("*.[ch]"))}
    return {name: _COMMENT.sub("", text) for name, text in (files | {"constants.h": constants()}).items()}


def hash_of(files: dict[str, str]) -> bytes:
    """Return what identifies the file that is compiled from sources."""
    parts = [*FLAGS, *CALLED, *EXPORTS, *(part for name in sorted(files) for part in (name, files[name]))]
    return hashlib.sha256("\0".join(parts).encode()).digest()


def places(files: dict[str, str]) -> tuple[str, list[str]]:
    """Return a C file with a place for every table and function that a model defines, and their names."""
    defined = "".join(text for name, text in files.items() if name.endswith(".c"))
    lines, names = ["#define const", '#include "instance.h"'], []
    for text in (files[name] for name in ("sizes.h", "instance.h", "kinfmu.h")):
        for kind, tables in _TABLE.findall(text):
            lines.append(f"{kind} {tables.replace('[]', f'[{UNSIZED}]')};")
            names += re.findall(r"(\w+)(?:\[[^;]*\])?(?:, |$)", tables)
        for kind, name, arguments in _FUNCTION.findall(text):
            if not re.search(rf"^[\w *]+\b{name}\([^;{{]*\)\s*{{", defined, re.MULTILINE):
                lines.append(f"{kind} {name}({arguments}) {{ {'' if kind == 'void' else 'return 0;'} }}")
                names.append(name)
    return "\n".join(lines) + "\n", [name for name in names if name != "kf_name"]


def compiled() -> bytes:
    """Return the module, with the hash of its sources."""
    files = sources()
    text, names = places(files)
    page = compiler.joined(["assign.h", *(name for name in sorted(files) if name.endswith(".c"))])
    exported = [f"-Wl,--export={name}" for name in (*names, *CALLED, *EXPORTS, "__heap_base")]
    with tempfile.TemporaryDirectory() as scratch:
        for name, content in (files | {"page.c": page, "places.c": text}).items():
            (Path(scratch) / name).write_text(content, "utf-8", newline="\n")
        command = [*COMMAND, *FLAGS, *exported, "page.c", "places.c", "-o", FILE.name]
        subprocess.run(command, cwd=scratch, check=True)
        return (Path(scratch) / FILE.name).read_bytes() + custom_section(SECTION, hash_of(files))


if __name__ == "__main__":
    FILE.write_bytes(compiled())
    print(f"{FILE}: {FILE.stat().st_size / 1000.0:.0f} kB")
