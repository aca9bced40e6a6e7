"""kf_names.h: names of their own for the functions of one FMU where several are linked into one program.

FMI calls its functions by FMI2_FUNCTION_PREFIX or FMI3_FUNCTION_PREFIX there; every other name follows it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

HEADER = "kf_names.h"


def prefixed(sources: Mapping[str, str], version: str) -> dict[str, str]:
    """Return C files that include kf_names.h first, and the file itself."""
    names = sorted({name for text in sources.values() for name in re.findall(r"\bkf_\w+", text)})
    include = f'#include "{HEADER}"\n'
    return {name: include + text for name, text in sources.items()} | {HEADER: _header(names, version)}


def _header(names: list[str], version: str) -> str:
    prefix = f"FMI{version[0]}_FUNCTION_PREFIX"
    lines = [
        f"/* With {prefix} every name begins with it, so that several FMUs can be linked into one program. */",
        "#ifndef KF_NAMES_H",
        "#define KF_NAMES_H",
        "",
        f"#ifdef {prefix}",
        "#define KF_PASTE(a, b) a##b",
        "#define KF_JOIN(a, b) KF_PASTE(a, b)",
        *(f"#define {name} KF_JOIN({prefix}, {name})" for name in names),
        "#endif",
        "",
        "#endif",
    ]
    return "\n".join(lines) + "\n"
