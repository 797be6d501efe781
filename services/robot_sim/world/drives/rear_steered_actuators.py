"""Drum and steering: a speed profile, a speed controller and a DC motor; and an angle that follows within its rate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from touchline.services.core.jit import kernel
from touchline.services.robot_sim.world import effects as e
from touchline.services.robot_sim.world.battery import voltage_of
from touchline.services.robot_sim.world.body import BATTERY_WH, STEP_S, BodyFigures
from touchline.services.robot_sim.world.drives import rear_steered_layout as r
from touchline.services.robot_sim.world.drives.dc_motor import MotorState, drag, follow, profile
from touchline.services.robot_sim.world.drives.rear_steered_layout import TrueRearSteered

Floats = NDArray[np.float64]


@kernel
def _steer(drive: TrueRearSteered, state: Floats, effects: Floats, commanded: float) -> None:
    """A first-order lag within the rate, which a weak pump lowers and a blocked linkage takes away."""
    wanted = min(max(commanded, -drive.stop_rad), drive.stop_rad)
    most = drive.steering_step_rad * effects[e.TORQUE + 1] * (1.0 - effects[e.BLOCKED + 1])
    state[r.STEERING] += min(max((wanted - state[r.STEERING]) * drive.steering_lag, -most), most)


@kernel
def actuate(drive: TrueRearSteered, state: Floats, body: BodyFigures, effects: Floats, commanded: Floats) -> float:
    """See `world_drive.actuate`: the drum's rate [rad/s] follows the first command, the steering [rad] the second.

    The drum's controller (`dc_motor`) follows the profile with feed-forward of the nominal inertia and friction. An
    empty battery moves neither. Only the drum's power counts [W], not below 0.
    """
    charge = state[BATTERY_WH] / body.battery_wh
    voltage = voltage_of(charge) if charge > 0.0 else 0.0
    if voltage > 0.0:
        _steer(drive, state, effects, commanded[1])
    before = state[r.REFERENCE]
    reference = profile(before, commanded[0], drive.max_rate_radps, drive.lag, drive.max_step_radps)
    state[r.REFERENCE] = reference
    ahead = drive.ahead_kgm2 * (reference - before) / STEP_S
    ahead += drag(reference, drive.viscous_nms, drive.friction_nm) * reference
    now = MotorState(state[r.DRUM_RATE], state[r.TORQUE], state[r.INTEGRAL])
    torque, integral, drawn = follow(drive.motor, now, reference, ahead, voltage, effects[e.TORQUE])
    state[r.TORQUE], state[r.INTEGRAL] = torque, integral
    power: float = max(drawn, 0.0)
    return power
