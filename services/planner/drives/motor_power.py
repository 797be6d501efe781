"""What a motor draws."""

import numpy as np

from touchline.schemas.vehicles import Motor
from touchline.services.planner.geometry.clothoid import Floats


def drawn_w(motor: Motor, torque_nm: Floats, rate_radps: Floats) -> Floats:
    """Electrical power (W) (n,) of a DC motor: mechanical with the gear's losses, and what heats the winding.

    Args:
        motor: Its figures, at the wheel.
        torque_nm: (n,) that it gives the wheel.
        rate_radps: (n,) of the wheel.
    """
    current_a = torque_nm / (motor.gear_ratio * motor.gear_efficiency * motor.constant_nm_per_a)
    return np.asarray(torque_nm * rate_radps / motor.gear_efficiency + motor.resistance_ohm * current_a**2)
