"""Linear tracker of a published study: poles placed for a constant reference, divided by its speed."""

from __future__ import annotations

import math
from typing import NamedTuple

from touchline.core.jit import kernel
from touchline.onboard.control.timed.tracking_law import Floats, TrackingErrors, Wanted


class LinearLaw(NamedTuple):
    """Gains of u₁ = −k₁e₁, u₂ = −k₂e₂ − k₃e₃ with k₁ = k₃ = 2ζa and k₂ = (a² − ω_d²)/v_d.

    For constant v_d and ω_d the linearised errors have the characteristic polynomial (λ + 2ζa)(λ² + 2ζaλ + a²)
    (Siciliano et al., see `tracking_law`, sec. 11.6.1). The study's faults are kept, because it is a baseline: k₂ grows
    without bound where the reference comes to rest. Only exactly there, where it does not exist, it is 0.

    Attributes:
        a_radps: Natural frequency.
        damping: ζ.
    """

    a_radps: float
    damping: float

    @kernel
    def steer(self, errors: TrackingErrors, wanted: Wanted, _memory: Floats) -> tuple[float, float]:
        """See `tracking_law.steer`."""
        a, k, v, w = self.a_radps, 2.0 * self.damping * self.a_radps, wanted.speed_mps, wanted.yaw_rate_radps
        k_across = (a * a - w * w) / v if v != 0.0 else 0.0
        speed = v * math.cos(errors.turn_rad) + k * errors.along_m
        return speed, w + k_across * errors.across_m + k * errors.turn_rad
