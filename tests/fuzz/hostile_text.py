"""Texts that do harm where a program passes them on unescaped."""

from __future__ import annotations

import random
import unicodedata

CANARY = "kinfmu_canary"  # what a text wants to be taken for code

TEXTS = (
    f'"; {CANARY}(); "',
    f"'; {CANARY}(); '",
    f'""" + {CANARY}() + """',
    f"''' + {CANARY}() + '''",
    f"*/ {CANARY}(); /*",
    f"// \\\n {CANARY}();",
    f"\\\n{CANARY}();",
    f"??/\n {CANARY}();",
    f"# {CANARY}\n{CANARY}()",
    f"\r{CANARY}()\r",
    f"\u2028{CANARY}()\u2029",
    f"{{{CANARY}}} {{0}} {{name}} {{{{",
    "%s%s%s%n%n %(name)s %99999999d",
    f"</title><script>{CANARY}()</script>",
    f'"><{CANARY} a="',
    f"]]><!-- <{CANARY}/> -->",
    f"<!DOCTYPE a [<!ENTITY {CANARY} SYSTEM 'file:///etc/passwd'>]>&{CANARY};",
    f"$({CANARY}) `{CANARY}` ; {CANARY} | {CANARY} && {CANARY}",
    f"-o /tmp/{CANARY}",
    f"@/tmp/{CANARY}",
    f"../../../../tmp/{CANARY}",
    f"/tmp/{CANARY}",  # noqa: S108  # a text
    f"C:\\{CANARY}",
    f"\\\\server\\{CANARY}",
    f"file:///tmp/{CANARY}",
    "nul\0byte",
    "\x1b]0;title\x07\x1b[31m",
    "\ufffe\uffff",
    "\u202e\u2066right to left",
    "\U0001f600\U0001f468\u200d\U0001f469\u200d\U0001f467",
    "e\u0301\u0327" * 20,
    "a" * 10_000,
    "\u00e9" * 10_000,
    "$\\frac{$ $x^{2}$ _{a}",
    "\\",
    "\\u0041\\x41\\n",
    "",
    " ",
    ".",
    "..",
    "-",
    "CON",
    "aux.txt",
    "\t\v\f",
)
_WORDS = (
    "for int double if while return static struct main printf NULL errno NAN INFINITY sin cos sqrt M_PI time "
    "constants lambda None True def class import global print self exec eval __import__ __builtins__ __name__ "
    "nan inf e pi_ t1 t2 t3 x y z u ud udd p phi k n i s c d q a_x a_phi crank_phi sin_a_phi kf_sin KF_DRIVERS "
    "solver model bound drive values rates residual tolerance unknowns margin errors status counts _ __ _0 CON "
    "NUL aux "
)
_NODES = "coupler_x coupler_y coupler_phi rocker_phi sin_coupler_phi cos_coupler_phi sin_rocker_phi t4 t5 t10"
IDENTIFIERS = [*_WORDS.split(), *_NODES.split(), "n" * 100]


def hostile(drawn: random.Random) -> str:
    """A text of the list, two of them, or random characters."""
    which = drawn.random()
    if which < 0.7:
        return drawn.choice(TEXTS)
    if which < 0.85:
        return drawn.choice(TEXTS) + drawn.choice(TEXTS)
    return "".join(chr(drawn.randrange(1, drawn.choice((128, 0xD800, 0x10000, 0x110000)))) for _ in range(20))


def toml(text: str) -> str:
    """The text as TOML writes it; halves of characters, which it cannot hold, as a question mark."""
    escaped = (f"\\U{ord(c):08X}" if unicodedata.category(c) != "Cs" else "?" for c in text)
    return '"' + "".join(escaped) + '"'
