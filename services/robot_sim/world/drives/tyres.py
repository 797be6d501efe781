"""Force of a tyre, or a drum, on the ground, for every drive.

The force grows with the slip and saturates at the grip: F = C·N·s / √(1 + (C·s/μ)²), with s the sliding speed over the
larger of wheel and ground speed; the same for both directions together (friction circle).
"""

from __future__ import annotations

import math
from typing import Final

from touchline.core.jit import kernel
from touchline.services.robot_sim.world.body import BodyFigures, BodyState

_CREEP_MPS = 0.02  # lower bound of the speed that slip is relative to
ROLLING_MPS: Final = 0.01
"""Rolling resistance is drag below this speed."""


@kernel
def stiffness(
    wheel_mps: float, ground_mps: float, side_mps: float, load_n: float, body: BodyFigures
) -> tuple[float, float]:
    """Compute the tyre force per sliding speed [N per m/s], along and across.

    That the force is linear in the slip at first and then saturates, the same for both directions together, is as in
    brush models (H. B. Pacejka, "Tire and Vehicle Dynamics", ch. 3); the curve between, see the module, is this
    project's own choice.

    Args:
        wheel_mps: Speed of the rim, along the wheel.
        ground_mps: Speed of the wheel's contact over the ground, along the wheel.
        side_mps: Speed of the contact, across the wheel.
        load_n: Load on the wheel.
        body: Gives grip and both stiffnesses.
    """
    reference = max(abs(wheel_mps), abs(ground_mps), _CREEP_MPS)
    along = body.stiffness_x * (wheel_mps - ground_mps) / reference
    across = body.stiffness_y * side_mps / reference
    factor = load_n / (reference * math.sqrt(1.0 + (along * along + across * across) / (body.grip * body.grip)))
    return body.stiffness_x * factor, body.stiffness_y * factor


@kernel
def held(state: BodyState, body: BodyFigures) -> bool:
    """Return True if tyres hold a standing robot on this slope: its sine is below half of the grip.

    Coulomb's friction, less a margin: that half of it counts is this project's own choice.

    Args:
        state: Gives the vertical in body axes.
        body: Gives the grip.
    """
    tilt = state.up_x * state.up_x + state.up_y * state.up_y
    holds: bool = tilt < (0.5 * body.grip) ** 2
    return holds
