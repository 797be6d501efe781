"""Response to commands in the physics' steps."""

from __future__ import annotations

import math

from touchline.services.robot_sim.world.body import STEP_S


def share_per_step(time_constant_s: float) -> float:
    """Return the share of the difference to its input that a first-order lag makes up in a step; all without lag."""
    return 1.0 - math.exp(-STEP_S / time_constant_s) if time_constant_s > 0.0 else 1.0


def travel_per_step(delay_s: float) -> float:
    """Return the share of its stroke that a plunger travels in one step; a whole stroke without a delay."""
    return min(1.0, STEP_S / delay_s) if delay_s > 0.0 else 1.0
