"""Faults of the drive's actuators."""

from __future__ import annotations

import numpy as np

from touchline.schemas import faults as f
from touchline.services.robot_sim.fault_effects.acting import Acting
from touchline.services.robot_sim.world.effects import Effects


def encoder_dropout(_fault: f.EncoderDropout, effects: Effects, acting: Acting) -> None:
    """No counts."""
    effects.encoder_out[acting.actuators] = 1


def wheel_blocked(_fault: f.WheelBlocked, effects: Effects, acting: Acting) -> None:
    """Held fast."""
    effects.blocked[acting.actuators] = 1


def wheel_slip(fault: f.WheelSlip, effects: Effects, acting: Acting) -> None:
    """The largest slip counts."""
    for number in acting.actuators:
        effects.slip[number] = max(effects.slip[number], fault.share, key=lambda share: (abs(share), share))


def motor_weak(fault: f.MotorWeak, effects: Effects, acting: Acting) -> None:
    """The weakest motor counts."""
    effects.torque_share[acting.actuators] = np.minimum(effects.torque_share[acting.actuators], fault.share)


def steering_offset(fault: f.SteeringOffset, effects: Effects, acting: Acting) -> None:
    """Offsets add up."""
    effects.offset_rad[acting.actuators] += fault.offset_rad
