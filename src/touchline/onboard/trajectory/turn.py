"""A turn on the spot between two legs."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class TurnInPlace:
    """Turn on the spot by `angle_rad` at up to `rate_radps` with `acceleration_radps2`."""

    angle_rad: float
    rate_radps: float
    acceleration_radps2: float

    @property
    def time_s(self) -> float:
        """Duration from standstill to standstill."""
        angle = abs(self.angle_rad)
        rate = min(self.rate_radps, math.sqrt(self.acceleration_radps2 * angle))
        return angle / rate + rate / self.acceleration_radps2 if rate > 0.0 else 0.0
