"""Dynamic feedback linearisation: turns the position into two double integrators, from which the heading follows."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from touchline.core.jit import kernel
from touchline.onboard.control.timed.tracking_law import Floats, TrackingErrors, Wanted

XI: Final = 0  # index in the memory: ξ, the speed that the law integrates [m/s]


class DynamicLaw(NamedTuple):
    """Gains of ξ̇ = a_x cos θ + a_y sin θ, v = ξ, ω = (a_y cos θ − a_x sin θ)/ξ, a = p̈_d + 2ζa(ṗ_d − ṗ) + a²(p_d − p).

    (G. Oriolo, A. De Luca and M. Vendittelli, "WMR control via dynamic feedback linearization: design, implementation,
    and experimental validation", IEEE Transactions on Control Systems Technology 10(6), 2002.) Exactly linear while ξ ≠
    0, but blind to the heading: a robot that faces backward ends on the path driving backward.

    Where the reference rests, v and ω are proportional to e₁ and e₃, and ξ is set to the reference's speed until that
    has left rest; the divisor of ω is at least that low speed.

    Attributes:
        a_radps: Natural frequency.
        damping: ζ.
        slow_mps: Speed of the reference, and of ξ, that counts as nearly at rest.
        step_s: Time between two calls.
    """

    a_radps: float
    damping: float
    slow_mps: float
    step_s: float

    @kernel
    def steer(self, errors: TrackingErrors, wanted: Wanted, memory: Floats) -> tuple[float, float]:
        """See `tracking_law.steer`; in the robot's frame, whose axes are along θ and across."""
        a, k, v, w = self.a_radps, 2.0 * self.damping * self.a_radps, wanted.speed_mps, wanted.yaw_rate_radps
        cos, sin = math.cos(errors.turn_rad), math.sin(errors.turn_rad)
        if v == 0.0:
            memory[XI] = 0.0
            return k * errors.along_m, w + k * errors.turn_rad
        if abs(v) <= self.slow_mps:
            memory[XI] = v
        xi = memory[XI]
        pull_along = wanted.acceleration_mps2 * cos - v * w * sin + k * (v * cos - xi) + a * a * errors.along_m
        pull_across = wanted.acceleration_mps2 * sin + v * w * cos + k * v * sin + a * a * errors.across_m
        memory[XI] = xi + self.step_s * pull_along
        return memory[XI], pull_across / math.copysign(max(abs(xi), self.slow_mps), xi)
