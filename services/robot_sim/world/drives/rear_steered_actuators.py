"""Drum and steering: a speed profile, a speed controller and a DC motor; and an angle that follows within its rate."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.jit import kernel
from touchline.services.robot_sim.world import effects as e
from touchline.services.robot_sim.world.battery import voltage_of
from touchline.services.robot_sim.world.body import BATTERY_WH, P_BATTERY_WH, STEP_S
from touchline.services.robot_sim.world.drives import rear_steered_layout as r

_DRY_RADPS = 0.05  # dry friction is drag below this rate of the drum

Floats = NDArray[np.float64]


@kernel
def drag(rate: float, p: Floats) -> float:
    """Friction of motor and gear [Nm per rad/s] at this rate of the drum: dry (Coulomb) and viscous.

    Args:
        rate: Of the drum [rad/s].
        p: (body.P_DRIVE + PARAMETER_SIZE,) the world's parameters; of them both frictions, at the drum.
    """
    coefficient: float = p[r.P_VISCOUS] + p[r.P_FRICTION] / max(abs(rate), _DRY_RADPS)
    return coefficient


@kernel
def _steer(state: Floats, p: Floats, effects: Floats, commanded: float) -> None:
    """A first-order lag within the rate, which a weak pump lowers and a blocked linkage takes away."""
    wanted = min(max(commanded, -p[r.P_STOP]), p[r.P_STOP])
    most = p[r.P_STEERING_STEP] * effects[e.TORQUE + 1] * (1.0 - effects[e.BLOCKED + 1])
    state[r.STEERING] += min(max((wanted - state[r.STEERING]) * p[r.P_STEERING_LAG], -most), most)


@kernel
def actuate(_drive: Any, state: Floats, p: Floats, effects: Floats, commanded: Floats) -> float:
    """See `world_drive.actuate`: the drum's rate [rad/s] follows the first command, the steering [rad] the second.

    The drum's controller follows the profile with feed-forward of the nominal inertia and friction, and a PI on the
    rest. Torque is limited by the current that the amplifier gives and by the voltage that the motor's own leaves of
    the battery's. An empty battery moves neither. Only the drum's power counts [W], not below 0.

    The motor is the usual equivalent circuit, torque k·i and voltage R·i + k·ω behind a gear, without inductance
    (G. F. Franklin, J. D. Powell, A. Emami-Naeini, "Feedback Control of Dynamic Systems", 7th ed., sec. 2.3): the
    current loop is a first-order lag instead. The integral stands still while the torque is limited (conditional
    integration: K. J. Åström, T. Hägglund, "PID Controllers", 2nd ed., sec. 3.5).
    """
    charge = state[BATTERY_WH] / p[P_BATTERY_WH]
    voltage = voltage_of(charge) if charge > 0.0 else 0.0
    if voltage > 0.0:
        _steer(state, p, effects, commanded[1])
    before, rate = state[r.REFERENCE], state[r.DRUM_RATE]
    target = min(max(commanded[0], -p[r.P_MAX_RATE]), p[r.P_MAX_RATE])
    reference = before + min(max((target - before) * p[r.P_LAG], -p[r.P_MAX_STEP]), p[r.P_MAX_STEP])
    state[r.REFERENCE] = reference
    error = reference - rate
    ahead = p[r.P_AHEAD] * (reference - before) / STEP_S + drag(reference, p) * reference
    wanted = ahead + p[r.P_GAIN] * error + state[r.INTEGRAL]
    most, back = p[r.P_TORQUE_PER_A] * p[r.P_MAX_CURRENT] * effects[e.TORQUE], p[r.P_EMF] * rate
    per_volt = p[r.P_TORQUE_PER_A] / p[r.P_RESISTANCE]
    upper = max(min(most, per_volt * (voltage - back)), 0.0) if voltage > 0.0 else 0.0
    lower = min(max(-most, per_volt * (-voltage - back)), 0.0) if voltage > 0.0 else 0.0
    limited = min(max(wanted, lower), upper)
    if limited == wanted:  # else the integral would wind up
        integral = state[r.INTEGRAL] + p[r.P_INTEGRAL_GAIN] * error * STEP_S
        state[r.INTEGRAL] = min(max(integral, -p[r.P_INTEGRAL_LIMIT]), p[r.P_INTEGRAL_LIMIT])
    state[r.TORQUE] += (limited - state[r.TORQUE]) * p[r.P_CURRENT_LAG]
    current = state[r.TORQUE] / p[r.P_TORQUE_PER_A]
    power: float = max(current * current * p[r.P_RESISTANCE] + back * current, 0.0)
    return power
