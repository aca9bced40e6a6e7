"""The two solvers: a file in Python has one of its name in C; docs/architecture.md lists the exceptions."""

from __future__ import annotations

from pathlib import Path

CHECKOUT = Path(__file__).parents[2]
SOLVER = CHECKOUT / "kinfmu" / "solver"
ONLY_PYTHON = {"status", "law_breaks"}
ONLY_C = {"position", "follower", "sweep", "designs", "solutions"}


def test_files_of_both_solvers_correspond_by_name() -> None:
    python = {path.stem for path in (SOLVER / "python").glob("*.py")} - {"__init__"}
    c = {path.stem for path in (SOLVER / "c").glob("*.c")}
    assert python - c == ONLY_PYTHON
    assert c - python == ONLY_C


def test_the_page_on_architecture_lists_the_files_without_a_counterpart() -> None:
    page = (CHECKOUT / "docs" / "architecture.md").read_text("utf-8")
    paragraph = page.partition("Each `.py` file of the solver")[2].partition("\n\n")[0]
    for name in [*(f"{stem}.py" for stem in ONLY_PYTHON), *(f"{stem}.c" for stem in ONLY_C)]:
        assert f"`{name}`" in paragraph
