"""documentation/licenses/license.txt of an FMU."""

from __future__ import annotations

_MIT = """\
MIT License

Copyright (c) 2026 The kinfmu authors

Permission is hereby granted, free of charge, to any person obtaining a copy
of this software and associated documentation files (the "Software"), to deal
in the Software without restriction, including without limitation the rights
to use, copy, modify, merge, publish, distribute, sublicense, and/or sell
copies of the Software, and to permit persons to whom the Software is
furnished to do so, subject to the following conditions:

The above copyright notice and this permission notice shall be included in all
copies or substantial portions of the Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR
IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY,
FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE
AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER
LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM,
OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE
SOFTWARE.
"""


def licence(*others: str) -> str:
    """Return documentation/licenses/license.txt: kinfmu's licence and other code inside.

    Args:
        others: Other code and the file of its licence, such as "pythonfmu, in pythonfmu.txt".

    """
    also = "".join(f"It also holds code of {other}.\n" for other in others)
    return f"""\
This FMU holds code of kinfmu, under the MIT License below. The mechanism in it belongs to its author.
{also}
{_MIT}"""
