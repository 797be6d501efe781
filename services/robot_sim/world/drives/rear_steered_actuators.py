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
from touchline.services.robot_sim.world.drives.dc_motor import DcMotor, MotorState, drag, follow, profile

Floats = NDArray[np.float64]


@kernel
def _motor(p: Floats, share: float) -> DcMotor:
    """The drum's, with a share of its torque."""
    return DcMotor(
        p[r.P_TORQUE_PER_A],
        p[r.P_EMF],
        p[r.P_RESISTANCE],
        p[r.P_TORQUE_PER_A] * p[r.P_MAX_CURRENT] * share,
        p[r.P_CURRENT_LAG],
        p[r.P_GAIN],
        p[r.P_INTEGRAL_GAIN],
        p[r.P_INTEGRAL_LIMIT],
    )


@kernel
def _steer(state: Floats, p: Floats, effects: Floats, commanded: float) -> None:
    """A first-order lag within the rate, which a weak pump lowers and a blocked linkage takes away."""
    wanted = min(max(commanded, -p[r.P_STOP]), p[r.P_STOP])
    most = p[r.P_STEERING_STEP] * effects[e.TORQUE + 1] * (1.0 - effects[e.BLOCKED + 1])
    state[r.STEERING] += min(max((wanted - state[r.STEERING]) * p[r.P_STEERING_LAG], -most), most)


@kernel
def actuate(_drive: Any, state: Floats, p: Floats, effects: Floats, commanded: Floats) -> float:
    """See `world_drive.actuate`: the drum's rate [rad/s] follows the first command, the steering [rad] the second.

    The drum's controller (`dc_motor`) follows the profile with feed-forward of the nominal inertia and friction. An
    empty battery moves neither. Only the drum's power counts [W], not below 0.
    """
    charge = state[BATTERY_WH] / p[P_BATTERY_WH]
    voltage = voltage_of(charge) if charge > 0.0 else 0.0
    if voltage > 0.0:
        _steer(state, p, effects, commanded[1])
    before = state[r.REFERENCE]
    reference = profile(before, commanded[0], p[r.P_MAX_RATE], p[r.P_LAG], p[r.P_MAX_STEP])
    state[r.REFERENCE] = reference
    ahead = p[r.P_AHEAD] * (reference - before) / STEP_S
    ahead += drag(reference, p[r.P_VISCOUS], p[r.P_FRICTION]) * reference
    now = MotorState(state[r.DRUM_RATE], state[r.TORQUE], state[r.INTEGRAL])
    torque, integral, drawn = follow(_motor(p, effects[e.TORQUE]), now, reference, ahead, voltage)
    state[r.TORQUE], state[r.INTEGRAL] = torque, integral
    power: float = max(drawn, 0.0)
    return power
