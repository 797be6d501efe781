"""Wheel drives: a speed profile, a speed controller, and a DC motor with current and voltage limits, for each wheel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.services.robot_sim.world.battery import voltage_of
from touchline.services.robot_sim.world.body import STEP_S, BodyFigures, BodyState
from touchline.services.robot_sim.world.drives.dc_motor import MotorState, drag, follow, profile
from touchline.services.robot_sim.world.drives.true_differential import DifferentialState, TrueDifferential
from touchline.services.robot_sim.world.effects import Effects

Floats = NDArray[np.float64]


@kernel
def actuate(
    drive: TrueDifferential,
    state: BodyState,
    wheels: DifferentialState,
    body: BodyFigures,
    effects: Effects,
    commanded: Floats,
) -> float:
    """Advance both drives by one step.

    The controllers (`dc_motor`) follow the profile with feed-forward of the nominal inertia and friction.

    Args:
        drive: Parameters of the drive.
        state: State of the body; the battery's charge is read.
        wheels: State of the drive; references, torques and integrals of both wheels are updated.
        body: Parameters of the body.
        effects: Effects of faults: share of the torque of each wheel.
        commanded: (2,) left, right [rad/s].

    Returns:
        Electrical power drawn [W], not below 0.
    """
    most, lag, step = drive.max_rate_radps, drive.lag, drive.max_step_radps
    left = profile(wheels.reference_radps[0], commanded[0], most, lag, step)
    right = profile(wheels.reference_radps[1], commanded[1], most, lag, step)
    left_accel = (left - wheels.reference_radps[0]) / STEP_S
    right_accel = (right - wheels.reference_radps[1]) / STEP_S
    wheels.reference_radps[0], wheels.reference_radps[1] = left, right
    both, turn = 0.5 * (left_accel + right_accel), 0.5 * (right_accel - left_accel)
    charge = state.battery_wh / body.battery_wh
    voltage = voltage_of(charge) if charge > 0.0 else 0.0
    power = 0.0
    for wheel in range(2):
        reference = wheels.reference_radps[wheel]
        ahead = drive.ahead_common_kgm2 * both + (2 * wheel - 1) * drive.ahead_turn_kgm2 * turn
        ahead += drag(reference, drive.viscous_nms, drive.friction_nm) * reference
        now = MotorState(wheels.rate_radps[wheel], wheels.torque_nm[wheel], wheels.integral_nm[wheel])
        torque, integral, drawn = follow(drive.motor, now, reference, ahead, voltage, effects.torque_share[wheel])
        wheels.torque_nm[wheel], wheels.integral_nm[wheel] = torque, integral
        power += drawn
    return max(power, 0.0)
