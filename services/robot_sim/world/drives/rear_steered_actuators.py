"""Drum and steering: a speed profile, a speed controller and a DC motor; and an angle that follows within its rate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from touchline.core.jit import kernel
from touchline.services.robot_sim.world.battery import voltage_of
from touchline.services.robot_sim.world.body import STEP_S, BodyFigures, BodyState
from touchline.services.robot_sim.world.drives.dc_motor import MotorState, drag, follow, profile
from touchline.services.robot_sim.world.drives.true_rear_steered import RearSteeredState, TrueRearSteered
from touchline.services.robot_sim.world.effects import Effects

Floats = NDArray[np.float64]


@kernel
def _steer(drive: TrueRearSteered, state: BodyState, effects: Effects, commanded: float) -> None:
    """Turn the steering with a first-order lag within its rate, which a weak pump lowers; a blocked one stays."""
    wanted = min(max(commanded, -drive.stop_rad), drive.stop_rad)
    most = 0.0 if effects.blocked[1] else drive.steering_step_rad * effects.torque_share[1]
    state.angles_rad[1] += min(max((wanted - state.angles_rad[1]) * drive.steering_lag, -most), most)


@kernel
def actuate(
    drive: TrueRearSteered,
    state: BodyState,
    drum: RearSteeredState,
    body: BodyFigures,
    effects: Effects,
    commanded: Floats,
) -> float:
    """See `world_drive.actuate`: the drum's rate [rad/s] follows the first command, the steering [rad] the second.

    The drum's controller (`dc_motor`) follows the profile with feed-forward of the nominal inertia and friction. An
    empty battery moves neither. Only the drum's power counts [W], not below 0.
    """
    charge = state.battery_wh / body.battery_wh
    voltage = voltage_of(charge) if charge > 0.0 else 0.0
    if voltage > 0.0:
        _steer(drive, state, effects, commanded[1])
    before = drum.reference_radps
    reference = profile(before, commanded[0], drive.max_rate_radps, drive.lag, drive.max_step_radps)
    drum.reference_radps = reference
    ahead = drive.ahead_kgm2 * (reference - before) / STEP_S
    ahead += drag(reference, drive.viscous_nms, drive.friction_nm) * reference
    now = MotorState(drum.rate_radps, drum.torque_nm, drum.integral_nm)
    torque, integral, drawn = follow(drive.motor, now, reference, ahead, voltage, effects.torque_share[0])
    drum.torque_nm, drum.integral_nm = torque, integral
    power: float = max(drawn, 0.0)
    return power
