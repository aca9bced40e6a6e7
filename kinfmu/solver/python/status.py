"""Status of a sample: how far its numbers can be trusted."""

from __future__ import annotations

from enum import IntEnum


class Status(IntEnum):
    """Status of a sample: 0 to 2 hold numbers, 3 to 5 do not."""

    OK = 0
    NEAR_SINGULAR = 1  # right, but with fewer digits: see the error estimate
    BRIDGED = 2  # interpolated across a singular point; the interpolated pose closes
    OUTSIDE = 3  # the drivers cannot take the mechanism there
    INCONSISTENT = 4  # a watch (a redundant row that is monitored) does not close there
    NOT_CONVERGED = 5
