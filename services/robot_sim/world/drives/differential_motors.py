"""The drives: a speed profile, a speed controller, and a DC motor with current and voltage limits, for each wheel."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.jit import kernel
from touchline.services.robot_sim.world import effects as e
from touchline.services.robot_sim.world.battery import voltage_of
from touchline.services.robot_sim.world.body import (
    BATTERY_WH,
    P_BATTERY_WH,
    STEP_S,
)
from touchline.services.robot_sim.world.drives.dc_motor import DcMotor, MotorState, drag, follow, profile
from touchline.services.robot_sim.world.drives.differential_layout import (
    INTEGRAL,
    LEFT_RATE,
    P_AHEAD_COMMON,
    P_AHEAD_TURN,
    P_CURRENT_LAG,
    P_EMF,
    P_FRICTION,
    P_GAIN,
    P_INTEGRAL_GAIN,
    P_LAG,
    P_MAX_ACCEL,
    P_MAX_CURRENT,
    P_MAX_RATE,
    P_RESISTANCE,
    P_TORQUE_PER_A,
    P_VISCOUS,
    REFERENCE,
    TORQUE,
)

_INTEGRAL_LIMIT_NM = 40.0

Floats = NDArray[np.float64]


@kernel
def _motor(p: Floats, share: float) -> DcMotor:
    """Either wheel's, with a share of its torque."""
    return DcMotor(
        p[P_TORQUE_PER_A],
        p[P_EMF],
        p[P_RESISTANCE],
        p[P_TORQUE_PER_A] * p[P_MAX_CURRENT] * share,
        p[P_CURRENT_LAG],
        p[P_GAIN],
        p[P_INTEGRAL_GAIN],
        _INTEGRAL_LIMIT_NM,
    )


@kernel
def actuate(_drive: Any, state: Floats, p: Floats, effects: Floats, commanded: Floats) -> float:
    """Advance both drives by one step.

    The controllers (`dc_motor`) follow the profile with feed-forward of the nominal inertia and friction.

    Args:
        _drive: Chooses this kernel.
        state: (body.DRIVE + STATE_SIZE,) the world's; references, torques and integrals of both wheels are updated.
        p: (body.P_DRIVE + PARAMETER_SIZE,) the world's parameters.
        effects: (effects.SIZE,) what faults do: `TORQUE` of each wheel.
        commanded: (interface.ACTUATORS,) left, right [rad/s].

    Returns:
        The electrical power drawn [W], not below 0.
    """
    most, lag, step = p[P_MAX_RATE], p[P_LAG], p[P_MAX_ACCEL] * STEP_S
    left = profile(state[REFERENCE], commanded[0], most, lag, step)
    right = profile(state[REFERENCE + 1], commanded[1], most, lag, step)
    left_accel = (left - state[REFERENCE]) / STEP_S
    right_accel = (right - state[REFERENCE + 1]) / STEP_S
    state[REFERENCE], state[REFERENCE + 1] = left, right
    both, turn = 0.5 * (left_accel + right_accel), 0.5 * (right_accel - left_accel)
    charge = state[BATTERY_WH] / p[P_BATTERY_WH]
    voltage = voltage_of(charge) if charge > 0.0 else 0.0
    power = 0.0
    for wheel in range(2):
        reference = state[REFERENCE + wheel]
        ahead = p[P_AHEAD_COMMON] * both + (2 * wheel - 1) * p[P_AHEAD_TURN] * turn
        ahead += drag(reference, p[P_VISCOUS], p[P_FRICTION]) * reference
        now = MotorState(state[LEFT_RATE + wheel], state[TORQUE + wheel], state[INTEGRAL + wheel])
        torque, integral, drawn = follow(_motor(p, effects[e.TORQUE + wheel]), now, reference, ahead, voltage)
        state[TORQUE + wheel], state[INTEGRAL + wheel] = torque, integral
        power += drawn
    return max(power, 0.0)
