"""Power series of the oracle as one more arithmetic for the joints' formulas."""

from __future__ import annotations

from kinfmu.joints import arithmetic
from tests import power_series

arithmetic.sin.register(power_series.Series, power_series.sin)
arithmetic.cos.register(power_series.Series, power_series.cos)
arithmetic.sqrt.register(power_series.Series, power_series.sqrt)
