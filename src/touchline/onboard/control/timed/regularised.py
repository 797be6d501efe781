"""Nonlinear tracker with the linear one's gains, except where the reference comes to rest."""

from __future__ import annotations

import math
from typing import NamedTuple

from touchline.core.angles import sinc
from touchline.core.jit import kernel
from touchline.onboard.control.timed.tracking_law import Floats, TrackingErrors, Wanted


class RegularisedLaw(NamedTuple):
    """Gains of `NonlinearLaw` with k₁ = k₃ = 2ζa and b = a²/(v_d² + v_ε²).

    While the reference moves these are the gains of `LinearLaw`; while it stands the lateral gain is 0, and those along
    the path and for the heading remain. The gain b·v_d is at most a²/(2v_ε).

    Attributes:
        a_radps: Natural frequency.
        damping: ζ.
        slow_mps: v_ε, at which the lateral gain is largest.
    """

    a_radps: float
    damping: float
    slow_mps: float

    @kernel
    def steer(self, errors: TrackingErrors, wanted: Wanted, _memory: Floats) -> tuple[float, float]:
        """See `tracking_law.steer`."""
        a, v, turn = self.a_radps, wanted.speed_mps, errors.turn_rad
        k, b = 2.0 * self.damping * a, a * a / (v * v + self.slow_mps * self.slow_mps)
        yaw_rate = wanted.yaw_rate_radps + b * v * sinc(turn) * errors.across_m + k * turn
        return v * math.cos(turn) + k * errors.along_m, yaw_rate
