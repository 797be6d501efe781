"""Nonlinear tracker with a Lyapunov function."""

from __future__ import annotations

import math
from typing import NamedTuple

from touchline.core.angles import sinc
from touchline.core.jit import kernel
from touchline.onboard.control.timed.tracking_law import Floats, TrackingErrors, Wanted


class NonlinearLaw(NamedTuple):
    """Gains of u₁ = −k₁e₁, u₂ = −b·v_d·(sin e₃/e₃)·e₂ − k₃e₃ with k₁ = k₃ = 2ζ√(ω_d² + b·v_d²).

    V = ½b(e₁² + e₂²) + ½e₃² never rises: V̇ = −b·k₁e₁² − k₃e₃², for any motion of the reference, and the errors vanish
    while it keeps moving (Y. Kanayama, Y. Kimura, F. Miyazaki and T. Noguchi, ICRA 1990; C. Samson, IEEE Transactions
    on Robotics and Automation 9(1), 1993).

    Attributes:
        damping: ζ.
        b_1pm2: b.
    """

    damping: float
    b_1pm2: float

    @kernel
    def steer(self, errors: TrackingErrors, wanted: Wanted, _memory: Floats) -> tuple[float, float]:
        """See `tracking_law.steer`."""
        v, w, b, turn = wanted.speed_mps, wanted.yaw_rate_radps, self.b_1pm2, errors.turn_rad
        k = 2.0 * self.damping * math.sqrt(w * w + b * v * v)
        return v * math.cos(turn) + k * errors.along_m, w + b * v * sinc(turn) * errors.across_m + k * turn
