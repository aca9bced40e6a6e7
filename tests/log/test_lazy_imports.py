"""Heavy packages are loaded when they are used, not before."""

from __future__ import annotations

import subprocess
import sys


def loaded(code: str) -> set[str]:
    """Return which of the heavy packages a new Python process has loaded after running `code`."""
    heavy = "{'rerun', 'mcap', 'pyarrow', 'zstandard', 'fmpy', 'pythonfmu', 'scipy'}"
    program = f"import sys\n{code}\nprint(*sorted({heavy} & set(sys.modules)))"
    process = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return set(process.stdout.split())


def test_importing_the_package_loads_nothing_heavy() -> None:
    assert loaded("import kinfmu.log") == set()


def test_naming_its_functions_loads_nothing_heavy() -> None:
    names = "from kinfmu.log import read, review, write_mcap, write_rrd, write_table"
    assert loaded(names) == set()


def test_public_names_are_there_and_no_others() -> None:
    code = """
import kinfmu.log
for name in kinfmu.log.__all__:
    assert callable(getattr(kinfmu.log, name)), name
    assert name in dir(kinfmu.log)
try:
    kinfmu.log.nothing
except AttributeError as error:
    assert 'nothing' in str(error)
else:
    raise AssertionError
"""
    assert loaded(code) == set()
