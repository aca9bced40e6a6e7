"""kf_names.h: unique names for the functions of one FMU, so that several can be linked into one program.

FMI puts FMI2_FUNCTION_PREFIX or FMI3_FUNCTION_PREFIX before its functions; this header does so for every other name.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

HEADER = "kf_names.h"


def prefixed(sources: Mapping[str, str], version: str) -> dict[str, str]:
    """Return the C files, each including kf_names.h first, and kf_names.h."""
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
