"""Power series of the oracle as one more arithmetic for the formulas of joints, drivers, loads and laws."""

from __future__ import annotations

from kinfmu.mechanism.quantities import arithmetic
from tests import power_series

arithmetic.sin.register(power_series.Series, power_series.sin)
arithmetic.cos.register(power_series.Series, power_series.cos)
arithmetic.sqrt.register(power_series.Series, power_series.sqrt)
arithmetic.floor.register(power_series.Series, power_series.floor)
arithmetic.curve.register(power_series.Series, power_series.curve)
arithmetic.atan2_like.register(power_series.Series, lambda _, y, x: power_series.angle(y, x))
