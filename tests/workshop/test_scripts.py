"""The scripts: set-up once, messages, arguments passed unchanged. No environment is really made here."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from tests.workshop.conftest import Miniature

CHECKOUT = Path(__file__).parents[2]
SCRIPTS = sorted(path for path in (CHECKOUT / "scripts").iterdir() if not path.suffix)
INSTALL = "python -m pip install --quiet --config-settings editable_mode=compat --editable "


def test_a_first_call_makes_the_environment_installs_and_runs(miniature: Miniature) -> None:
    status, printed = miniature.run("demo")
    assert status == 0, printed
    assert miniature.asked == [
        f"python3 -m venv {miniature.root}/.venv",
        f"{INSTALL}.[figures,viewer]",
        "python -m kinfmu.cli.demo",
    ]


def test_a_second_call_only_runs(miniature: Miniature) -> None:
    miniature.run("demo")
    assert miniature.run("demo") == (0, "")
    assert miniature.asked == ["python -m kinfmu.cli.demo"]


def test_tests_need_more_than_the_demo_and_the_demo_nothing_more_than_tests(miniature: Miniature) -> None:
    miniature.run("demo")
    miniature.run("test")
    assert miniature.asked == [f"{INSTALL}.[dev]", "python -m pytest --numprocesses auto --dist loadfile"]
    miniature.run("demo")
    assert miniature.asked == ["python -m kinfmu.cli.demo"]


def test_a_changed_pyproject_is_installed_again(miniature: Miniature) -> None:
    miniature.run("setup")
    (miniature.root / "pyproject.toml").write_text("[project]\nname = 'other'\n")
    miniature.run("setup")
    assert miniature.asked == [f"{INSTALL}.[dev]"]
    assert miniature.run("setup") == (0, "")
    assert miniature.asked == []


def test_a_moved_checkout_gets_a_new_environment(miniature: Miniature) -> None:
    miniature.run("setup")
    miniature.root = miniature.root.rename(miniature.root.with_name("moved"))
    miniature.run("setup")
    assert miniature.asked == [f"python3 -m venv {miniature.root}/.venv", f"{INSTALL}.[dev]"]


def test_a_failed_installation_is_reported_and_started_again(miniature: Miniature) -> None:
    status, printed = miniature.run("demo", PIP_FAILS="1")
    assert status == 1
    assert printed.splitlines()[-1] == "kinfmu: installing into .venv failed, see above"
    assert miniature.asked[-1] == f"{INSTALL}.[figures,viewer]"
    assert miniature.run("demo")[0] == 0
    assert miniature.asked == [
        f"python3 -m venv {miniature.root}/.venv",
        f"{INSTALL}.[figures,viewer]",
        "python -m kinfmu.cli.demo",
    ]


def test_an_interrupted_update_is_begun_again(miniature: Miniature) -> None:
    miniature.run("demo")
    assert miniature.run("test", PIP_FAILS="1")[0] == 1
    miniature.run("demo")
    assert miniature.asked == [
        f"python3 -m venv {miniature.root}/.venv",
        f"{INSTALL}.[figures,viewer]",
        "python -m kinfmu.cli.demo",
    ]


def test_a_broken_environment_is_made_again(miniature: Miniature) -> None:
    miniature.run("demo")
    (miniature.root / ".venv" / "bin" / "python").unlink()
    assert miniature.run("demo")[0] == 0
    assert miniature.asked[0] == f"python3 -m venv {miniature.root}/.venv"


def test_an_environment_that_somebody_made_by_hand_is_kept(miniature: Miniature) -> None:
    tools = miniature.root / ".venv" / "bin"
    tools.mkdir(parents=True)
    shutil.copy(miniature.python, tools / "python")
    (tools / "theirs").touch()
    miniature.run("demo")
    assert miniature.asked == [f"{INSTALL}.[figures,viewer]", "python -m kinfmu.cli.demo"]
    assert (tools / "theirs").exists()


def test_a_copy_installed_by_hand_is_replaced_with_a_word(miniature: Miniature) -> None:
    tools = miniature.root / ".venv" / "bin"
    tools.mkdir(parents=True)
    shutil.copy(miniature.python, tools / "python")
    printed = (
        "kinfmu: .venv has kinfmu as pip installed it; this checkout itself, which later edits change, replaces it"
    )
    shown = "Name: kinfmu\\nVersion: 1.0\\n"
    assert printed in miniature.run("demo", PIP_SHOWS=shown)[1].splitlines()
    assert miniature.asked == [f"{INSTALL}.[figures,viewer]", "python -m kinfmu.cli.demo"]
    (miniature.root / ".venv" / "installed").unlink()
    for other in (shown + "Editable project location: /here\\n", ""):
        assert printed not in miniature.run("demo", PIP_SHOWS=other)[1]


def test_no_python_at_all_is_reported_in_one_line(miniature: Miniature) -> None:
    miniature.python.unlink()
    status, printed = miniature.run("demo")
    assert status == 1
    assert printed == (
        "kinfmu: needs Python 3.11 or newer with venv and pip; "
        "looked for python3, python3.11 to python3.14; found none\n"
    )


def test_a_python_that_is_too_old_is_named(miniature: Miniature) -> None:
    status, printed = miniature.run("demo", PYTHON_VERSION="3.9")
    assert status == 1
    assert printed.endswith("python3.11 to python3.14; python3 is 3.9\n")
    assert miniature.asked == []


def test_a_python_without_venv_is_reported_with_what_to_install(miniature: Miniature) -> None:
    status, printed = miniature.run("demo", NO_VENV="1")
    assert status == 1
    assert printed.endswith("python3 is 3.11 without venv (Debian: apt-get install python3.11-venv)\n")


def test_a_newer_python_next_to_an_old_one_is_found(miniature: Miniature) -> None:
    newer = miniature.bin / "python3.12"
    miniature.python.rename(newer)
    miniature.python.write_text("#!/bin/sh\ncase $2 in *print*) echo 3.9 ;; *) exit 1 ;; esac\n")
    miniature.python.chmod(0o755)
    miniature.run("demo")
    assert miniature.asked[0].startswith("python3.12 -m venv")


def test_another_active_environment_does_not_leak(miniature: Miniature) -> None:
    miniature.run("demo", PYTHONPATH="/elsewhere", VIRTUAL_ENV="/elsewhere")
    assert miniature.environment == f"PYTHONPATH=unset VIRTUAL_ENV=unset cwd={miniature.root}"


def test_arguments_are_passed_on_unchanged_and_the_callers_folder_is_kept(miniature: Miniature, tmp_path: Path) -> None:
    miniature.run("simulate", "my mechanism.toml", "--stop", "2", cwd=tmp_path)
    assert miniature.asked[-1] == "kinfmu simulate my mechanism.toml --stop 2"
    assert miniature.environment.endswith(f"cwd={tmp_path}")
    miniature.run("bench", "--help", cwd=tmp_path)
    assert miniature.asked[-1] == "python -m benchmarks --help"


def test_tests_run_in_the_checkout_from_any_folder(miniature: Miniature, tmp_path: Path) -> None:
    miniature.run("test", "tests/mechanism/joints", "-k", "revolute", cwd=tmp_path)
    assert (
        miniature.asked[-1] == "python -m pytest --numprocesses auto --dist loadfile tests/mechanism/joints -k revolute"
    )
    assert miniature.environment.endswith(f"cwd={miniature.root}")


@pytest.mark.parametrize("script", ["setup", "demo", "check", "docs", "graphics", "browser", "video"])
def test_help_is_printed_without_setting_anything_up(miniature: Miniature, script: str) -> None:
    status, printed = miniature.run(script, "--help")
    assert status == 0
    assert printed.startswith(f"scripts/{script}")
    assert "set -euo" not in printed
    assert miniature.asked == []


@pytest.mark.parametrize("script", ["setup", "demo", "docs", "graphics", "browser", "video"])
def test_an_argument_that_means_nothing_is_wrong_usage(miniature: Miniature, script: str) -> None:
    assert miniature.run(script, "all") == (2, f"kinfmu: scripts/{script} takes no arguments, got 'all'\n")
    assert miniature.asked == []


def test_check_names_the_checks_it_knows(miniature: Miniature) -> None:
    status, printed = miniature.run("check", "lint", "spelling")
    assert status == 2
    assert printed == "kinfmu: scripts/check does not know 'spelling'; checks: lint, format, types, imports, words\n"


def test_check_goes_on_after_a_failure_and_fails_in_the_end(miniature: Miniature) -> None:
    miniature.run("setup")
    tools = miniature.root / ".venv" / "bin"
    for tool, status in (("ruff", 1), ("mypy", 0), ("lint-imports", 0)):
        (tools / tool).write_text(f'#!/bin/sh\necho "{tool} $*"\nexit {status}\n')
        (tools / tool).chmod(0o755)
    assert miniature.run("check") == (1, "ruff check .\nruff format --check .\nmypy \nlint-imports \n")
    assert miniature.asked == ["python scripts/words.py"]
    assert miniature.run("check", "types") == (0, "mypy \n")


def test_graphics_without_apt_says_what_to_install(miniature: Miniature) -> None:
    status, printed = miniature.run("graphics")
    assert status == 1
    assert printed == (
        "kinfmu: no apt-get here; install a Vulkan driver another way "
        "(Debian calls it mesa-vulkan-drivers libvulkan1)\n"
    )


@pytest.mark.parametrize("script", [*SCRIPTS, CHECKOUT / ".ci" / "run"], ids=lambda path: path.name)
def test_every_script_is_executable_and_careful(script: Path) -> None:
    assert script.stat().st_mode & 0o111 == 0o111
    text = script.read_text()
    assert text.startswith("#!/usr/bin/env bash\n# ")
    assert "\nset -euo pipefail\n" in text


def test_every_script_is_clean_to_shellcheck() -> None:
    shellcheck = shutil.which("shellcheck")
    if shellcheck is None:
        pytest.skip("shellcheck is not installed")
    scripts = [*SCRIPTS, CHECKOUT / "scripts" / "environment.sh", CHECKOUT / ".ci" / "run"]
    done = subprocess.run([shellcheck, "-x", "-P", "SCRIPTDIR", *scripts], capture_output=True, text=True, check=False)
    assert done.stdout == ""
