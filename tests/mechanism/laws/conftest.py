"""Power series of the oracle as one more arithmetic for the laws' formulas."""

from __future__ import annotations

import tests.mechanism.joints.conftest  # noqa: F401  registers them
