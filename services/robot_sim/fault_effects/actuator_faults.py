"""Faults of the drive's actuators."""

from __future__ import annotations

import numpy as np

from touchline.schemas import faults as f
from touchline.services.robot_sim.fault_effects.acting import Acting
from touchline.services.robot_sim.world.effects import Effects


def encoder_dropout(_fault: f.EncoderDropout, effects: Effects, acting: Acting) -> None:
    """Drop the encoders' counts; see `ApplyFault`."""
    effects.encoder_out[acting.actuators] = 1


def wheel_blocked(_fault: f.WheelBlocked, effects: Effects, acting: Acting) -> None:
    """Block the wheels; see `ApplyFault`."""
    effects.blocked[acting.actuators] = 1


def wheel_slip(fault: f.WheelSlip, effects: Effects, acting: Acting) -> None:
    """Add slip: the largest counts; see `ApplyFault`."""
    for number in acting.actuators:
        effects.slip[number] = max(effects.slip[number], fault.share, key=lambda share: (abs(share), share))


def motor_weak(fault: f.MotorWeak, effects: Effects, acting: Acting) -> None:
    """Weaken the motors: the weakest counts; see `ApplyFault`."""
    effects.torque_share[acting.actuators] = np.minimum(effects.torque_share[acting.actuators], fault.share)


def steering_offset(fault: f.SteeringOffset, effects: Effects, acting: Acting) -> None:
    """Offset the steering: offsets add up; see `ApplyFault`."""
    effects.offset_rad[acting.actuators] += fault.offset_rad
