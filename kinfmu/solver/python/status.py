"""Status of a sample: how far its numbers can be trusted."""

from __future__ import annotations

from enum import IntEnum


class Status(IntEnum):
    """0 to 2 hold numbers, 3 to 5 do not."""

    OK = 0
    NEAR_SINGULAR = 1  # right, but with fewer digits: see the error estimate
    BRIDGED = 2  # interpolated across a singular point, proved by closing
    OUTSIDE = 3  # the drivers cannot take the mechanism there
    INCONSISTENT = 4  # a constraint set aside as redundant does not hold there
    NOT_CONVERGED = 5
