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

_DRY_RADPS = 0.05  # dry friction is drag below this wheel speed
_INTEGRAL_LIMIT_NM = 40.0

Floats = NDArray[np.float64]


@kernel
def profile(reference: float, command: float, p: Floats) -> float:
    """The drive's reference a step later: a first-order lag, then the acceleration limit, within the speed limit.

    Args:
        reference: Of one wheel, now [rad/s].
        command: To it [rad/s].
        p: (body.P_DRIVE + PARAMETER_SIZE,) the world's parameters; of them the limits and the lag.

    Returns:
        The reference [rad/s].
    """
    target = min(max(command, -p[P_MAX_RATE]), p[P_MAX_RATE])
    limit = p[P_MAX_ACCEL] * STEP_S
    stepped: float = reference + min(max((target - reference) * p[P_LAG], -limit), limit)
    return stepped


@kernel
def drag(rate: float, p: Floats) -> float:
    """Friction of motor and gear [Nm per rad/s] at this wheel speed: dry (Coulomb) and viscous.

    Args:
        rate: Of the wheel [rad/s].
        p: (body.P_DRIVE + PARAMETER_SIZE,) the world's parameters; of them both frictions, at the wheel.
    """
    coefficient: float = p[P_VISCOUS] + p[P_FRICTION] / max(abs(rate), _DRY_RADPS)
    return coefficient


@kernel
def actuate(_drive: Any, state: Floats, p: Floats, effects: Floats, commanded: Floats) -> float:
    """Advance both drives by one step.

    The controllers follow the profile with feed-forward of the nominal inertia and friction, and a PI on the rest.
    Torque is limited by the current that the amplifier gives and by the voltage that the motor's own leaves of the
    battery's. An empty battery gives nothing.

    The motor is the usual equivalent circuit, torque k·i and voltage R·i + k·ω behind a gear, without inductance
    (G. F. Franklin, J. D. Powell, A. Emami-Naeini, "Feedback Control of Dynamic Systems", 7th ed., sec. 2.3): the
    current loop is a first-order lag instead. The integral stands still while the torque is limited (conditional
    integration: K. J. Åström, T. Hägglund, "PID Controllers", 2nd ed., sec. 3.5).

    Args:
        _drive: Chooses this kernel.
        state: (body.DRIVE + STATE_SIZE,) the world's; references, torques and integrals of both wheels are updated.
        p: (body.P_DRIVE + PARAMETER_SIZE,) the world's parameters.
        effects: (effects.SIZE,) what faults do: `TORQUE` of each wheel.
        commanded: (interface.ACTUATORS,) left, right [rad/s].

    Returns:
        The electrical power drawn [W], not below 0.
    """
    left = profile(state[REFERENCE], commanded[0], p)
    right = profile(state[REFERENCE + 1], commanded[1], p)
    left_accel = (left - state[REFERENCE]) / STEP_S
    right_accel = (right - state[REFERENCE + 1]) / STEP_S
    state[REFERENCE], state[REFERENCE + 1] = left, right
    both, turn = 0.5 * (left_accel + right_accel), 0.5 * (right_accel - left_accel)
    charge = state[BATTERY_WH] / p[P_BATTERY_WH]
    voltage = voltage_of(charge) if charge > 0.0 else 0.0
    power = 0.0
    for wheel in range(2):
        rate, reference = state[LEFT_RATE + wheel], state[REFERENCE + wheel]
        error = reference - rate
        ahead = p[P_AHEAD_COMMON] * both + (2 * wheel - 1) * p[P_AHEAD_TURN] * turn
        ahead += (p[P_VISCOUS] + p[P_FRICTION] / max(abs(reference), _DRY_RADPS)) * reference
        wanted = ahead + p[P_GAIN] * error + state[INTEGRAL + wheel]
        most = p[P_TORQUE_PER_A] * p[P_MAX_CURRENT] * effects[e.TORQUE + wheel]
        back = p[P_EMF] * rate
        per_volt = p[P_TORQUE_PER_A] / p[P_RESISTANCE]
        upper = max(min(most, per_volt * (voltage - back)), 0.0) if voltage > 0.0 else 0.0
        lower = min(max(-most, per_volt * (-voltage - back)), 0.0) if voltage > 0.0 else 0.0
        limited = min(max(wanted, lower), upper)
        if limited == wanted:  # else the integral would wind up
            integral = state[INTEGRAL + wheel] + p[P_INTEGRAL_GAIN] * error * STEP_S
            state[INTEGRAL + wheel] = min(max(integral, -_INTEGRAL_LIMIT_NM), _INTEGRAL_LIMIT_NM)
        state[TORQUE + wheel] += (limited - state[TORQUE + wheel]) * p[P_CURRENT_LAG]
        current = state[TORQUE + wheel] / p[P_TORQUE_PER_A]
        power += current * current * p[P_RESISTANCE] + back * current
    return max(power, 0.0)
