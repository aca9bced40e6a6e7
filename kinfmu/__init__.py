"""kinfmu: planar kinematics, from a mechanism file to an FMU and logs.

    import kinfmu

    mech = kinfmu.load("crank_rocker")
    run = kinfmu.solve(mech, crank_angle=[0.0, 0.5, 1.0])
    run["tracer.x"]

Names are imported when first used, so that `import kinfmu` takes a few milliseconds. They are listed once: as imports
in `__init__.pyi`, which type checkers and editors read as well.
"""

from kinfmu.version import VERSION

__version__ = VERSION


def _public_names():
    """Return the package of every public name, as the stub next to this file imports it."""
    stub = __loader__.get_data(f"{__path__[0]}/__init__.pyi").decode()  # in a folder or in a zip file
    imports = [line.split() for line in stub.splitlines() if line.startswith("from ")]
    return {name: package for _, package, _, name, *_ in imports}


_HOME = _public_names()
__all__ = ["VERSION", *_HOME]


def __getattr__(name):
    """Import a public name from its package when it is first used."""
    from importlib import import_module

    if name not in _HOME:
        raise AttributeError(f"module 'kinfmu' has no attribute '{name}'")
    if _HOME[name] == "kinfmu":
        return import_module(f"kinfmu.{name}")
    value = globals()[name] = getattr(import_module(_HOME[name]), name)
    return value


def __dir__():
    return sorted({*globals(), *_HOME})
