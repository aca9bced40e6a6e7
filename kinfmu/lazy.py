"""Packages that import a public name when it is first used, so that a command imports only what it needs."""

from __future__ import annotations

TYPE_CHECKING = False  # that of `typing` takes longer to import than all of this
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any


def names(package: dict[str, Any]) -> tuple[list[str], Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__all__`, `__getattr__` and `__dir__` of a package.

    A public name is not that of a module of the package, which would take its place when it is imported.

    Args:
        package: Globals of its `__init__.py`.

    """
    name, home_of = package["__name__"], homes(package)

    def value_of(public: str) -> Any:
        from importlib import import_module

        if public not in home_of:
            raise AttributeError(f"module '{name}' has no attribute '{public}'")
        if home_of[public] == name:
            return import_module(f"{name}.{public}")
        value = package[public] = getattr(import_module(home_of[public]), public)
        return value

    return [*home_of], value_of, lambda: sorted({*package, *home_of})


def homes(package: dict[str, Any]) -> dict[str, str]:
    """Return the public names of a package, each with the module that it is imported from.

    They are listed once: as imports in `__init__.pyi`, which type checkers and editors read as well.
    """
    stub = package["__loader__"].get_data(f"{package['__path__'][0]}/__init__.pyi").decode()  # also in a zip file
    imports = [line.split() for line in stub.splitlines() if line.startswith("from ")]
    return {public: module for _, module, _, public, *_ in imports}
