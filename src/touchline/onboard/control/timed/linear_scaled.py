"""Linear tracker with gains that are scaled by the reference's motion."""

from __future__ import annotations

import math
from typing import NamedTuple

from touchline.core.jit import kernel
from touchline.onboard.control.timed.tracking_law import Floats, TrackingErrors, Wanted


class ScaledLinearLaw(NamedTuple):
    """Gains of `LinearLaw` with a² = ω_d² + b·v_d²: k₁ = k₃ = 2ζ√(ω_d² + b·v_d²), k₂ = b·v_d.

    No gain is infinite, but all of them are 0 where the reference rests (C. Canudas de Wit, H. Khennouf, C. Samson and
    O. J. Sørdalen, "Nonlinear control design for mobile robots", in: Recent Trends in Mobile Robots, 1993).

    Attributes:
        damping: ζ.
        b_1pm2: b.
    """

    damping: float
    b_1pm2: float

    @kernel
    def steer(self, errors: TrackingErrors, wanted: Wanted, _memory: Floats) -> tuple[float, float]:
        """See `tracking_law.steer`."""
        v, w, b = wanted.speed_mps, wanted.yaw_rate_radps, self.b_1pm2
        k = 2.0 * self.damping * math.sqrt(w * w + b * v * v)
        speed = v * math.cos(errors.turn_rad) + k * errors.along_m
        return speed, w + b * v * errors.across_m + k * errors.turn_rad
