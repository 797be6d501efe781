"""Electrical power of a motor."""

import numpy as np

from touchline.schemas.vehicles import Motor
from touchline.services.planner.geometry.clothoid import Floats


def drawn_w(motor: Motor, torque_nm: Floats, rate_radps: Floats) -> Floats:
    """Electrical power (W) (n,) of a DC motor: mechanical power, gear losses and heat of the winding.

    Args:
        motor: Data of the motor, referred to the wheel.
        torque_nm: (n,) torque at the wheel.
        rate_radps: (n,) rate of the wheel.
    """
    current_a = torque_nm / (motor.gear_ratio * motor.gear_efficiency * motor.constant_nm_per_a)
    return np.asarray(torque_nm * rate_radps / motor.gear_efficiency + motor.resistance_ohm * current_a**2)
