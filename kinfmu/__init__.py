"""kinfmu: planar kinematics, from a mechanism file to an FMU and logs.

    import kinfmu

    mech = kinfmu.load("crank_rocker")
    run = kinfmu.solve(mech, crank_angle=[0.0, 0.5, 1.0])
    run["tracer.x"]

Names are imported when first used, so that `import kinfmu` takes less than a millisecond (kinfmu/lazy.py).
"""

from kinfmu import lazy
from kinfmu.version import VERSION

__version__ = VERSION
_public, __getattr__, __dir__ = lazy.names(globals())
__all__ = ["VERSION", *_public]
