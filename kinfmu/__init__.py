"""kinfmu: planar kinematics, from a mechanism file to an FMU and logs.

    import kinfmu

    mech = kinfmu.load("crank_rocker")
    run = kinfmu.solve(mech, crank_angle=[0.0, 0.5, 1.0])
    run["tracer.x"]

Names are imported when first used, so that `import kinfmu` takes a few milliseconds, and a command imports only what it
needs. They are listed once: as imports in `__init__.pyi`, which type checkers and editors read as well.
"""

from kinfmu.version import VERSION


def _homes(package):
    """Return the public names of a package, from the globals of its `__init__.py`, each with its module."""
    stub = package["__loader__"].get_data(f"{package['__path__'][0]}/__init__.pyi").decode()  # also in a zip file
    imports = [line.split() for line in stub.splitlines() if line.startswith("from ")]
    return {name: module for _, module, _, name, *_ in imports}


def _lazy(package):
    """Return `__all__`, `__getattr__` and `__dir__` of a package, by its globals, that import names when first used.

    A public name is not that of a module of the package, which would take its place when it is imported.
    """
    homes, own = _homes(package), package["__name__"]

    def value_of(name):
        from importlib import import_module

        if name not in homes:
            raise AttributeError(f"module '{own}' has no attribute '{name}'")
        if homes[name] == own:
            return import_module(f"{own}.{name}")
        value = package[name] = getattr(import_module(homes[name]), name)
        return value

    return [*homes], value_of, lambda: sorted({*package, *homes})


__version__ = VERSION
__all__, __getattr__, __dir__ = _lazy(globals())
__all__.insert(0, "VERSION")
