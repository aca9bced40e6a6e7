"""Solution of Andrews' squeezer at its end, published with the Test Set for IVP Solvers.

It starts at rest and is driven by a constant torque; the mechanism is that of `tests.run.test_lagrange`.
"""

from __future__ import annotations

END = 0.03  # [s]
AT_END = {  # angles [rad] and rates [rad/s], computed with a tolerance of 1e-14
    "beta": (0.1581077119629904e2, 0.1139920302151208e4),
    "theta": (-0.1575637105984298e2, -0.1424379294994111e4),
    "gamma": (0.4082224013073101e-1, 0.1103291221937134e2),
    "phi": (-0.5347301163226948, 0.1929337464421385e2),
    "delta": (0.5244099658805304, 0.5735699284790808),
    "omega": (0.5347301163226948, -0.1929337464421385e2),
    "epsilon": (0.1048080741042263e1, 0.3231791658026955),
}
BODIES = {  # angles of the bodies, as sums of those of the test set
    "k1": ("beta",),
    "k2": ("beta", "theta"),
    "k3": ("gamma",),
    "k4": ("phi", "delta"),
    "k5": ("delta",),
    "k6": ("omega", "epsilon"),
    "k7": ("epsilon",),
}
