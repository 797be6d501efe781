"""The 1 ms physics of a differential-drive robot with a sprayer: one kernel call per onboard tick.

Each wheel's speed follows its command through a first-order lag, bounded in speed and acceleration; the ground
speeds (wheel speed × true radius × slip) give a body twist that is held over the millisecond and integrated
exactly along its arc. Valve and disc are plungers that travel at constant speed: open (down) when they reach the
far end, closed (up) when they are back, so that a pulse shorter than the delay does nothing. Paint flows when the
valve is open and the tank is not empty; the disc shapes the edge but does not gate the flow.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from schemas.jit import kernel
from services.robot_sim.world.randomness import STREAM_SLIP, normal

STEP_S: Final = 0.001
"""Physics step [s]."""
STEPS: Final = 10
"""Physics steps of one kernel call."""

# State vector.
EAST: Final = 0
NORTH: Final = 1
HEADING: Final = 2  # rad, unwrapped
LEFT_RATE: Final = 3  # rad/s
RIGHT_RATE: Final = 4
LEFT_ANGLE: Final = 5  # rad, cumulative
RIGHT_ANGLE: Final = 6
SPEED: Final = 7  # m/s, of the axle centre
YAW_RATE: Final = 8  # rad/s
LEFT_SLIP: Final = 9  # relative loss of ground speed
RIGHT_SLIP: Final = 10
VALVE: Final = 11  # plunger position, 0 closed … 1 open
VALVE_OPEN: Final = 12  # 0 or 1
DISC: Final = 13
DISC_DOWN: Final = 14
TANK_L: Final = 15
BATTERY_WH: Final = 16
POWER_W: Final = 17
FLOW_LPS: Final = 18
MEAN_YAW_RATE: Final = 19  # over the tick: what a rate-integrating gyro sees
MEAN_ACCEL_X: Final = 20
MEAN_ACCEL_Y: Final = 21
STATE_SIZE: Final = 22

# Parameter vector.
P_LEFT_RADIUS: Final = 0
P_RIGHT_RADIUS: Final = 1
P_TRACK: Final = 2
P_MAX_RATE: Final = 3
P_MAX_ACCEL: Final = 4
P_LAG: Final = 5  # s
P_SLIP_SIGMA: Final = 6
P_SLIP_DECAY: Final = 7  # per tick, exp(−10 ms / τ)
P_NOZZLE_X: Final = 8
P_NOZZLE_Y: Final = 9
P_VALVE_ON: Final = 10  # plunger travel in one step
P_VALVE_OFF: Final = 11
P_DISC: Final = 12
P_FLOW_LPS: Final = 13
P_IDLE_W: Final = 14
P_DRIVE_W: Final = 15  # per m/s
PARAMETER_SIZE: Final = 16

# Trace of the nozzle: row 0 is the tick's start, row k the state after step k.
TRACE_EAST: Final = 0
TRACE_NORTH: Final = 1
TRACE_SPRAYING: Final = 2  # whether paint flowed during the step that ends in this row
TRACE_SHAPE: Final = (STEPS + 1, 3)

_ARRIVED = 1.0 - 1e-9
_HOME = 1e-9


@kernel
def _wheel(rate: float, target: float, p: NDArray[np.float64]) -> float:
    target = min(max(target, -p[P_MAX_RATE]), p[P_MAX_RATE])
    change = (target - rate) * (1.0 - math.exp(-STEP_S / p[P_LAG])) if p[P_LAG] > 0.0 else target - rate
    limit = p[P_MAX_ACCEL] * STEP_S
    stepped: float = rate + min(max(change, -limit), limit)
    return stepped


@kernel
def _plunger(position: float, engaged: float, commanded: bool, on: float, off: float) -> tuple[float, float]:
    if commanded:
        position = min(position + on, 1.0)
        return position, 1.0 if position >= _ARRIVED else engaged
    position = max(position - off, 0.0)
    return position, 0.0 if position <= _HOME else engaged


@kernel
def _trace_row(state: NDArray[np.float64], p: NDArray[np.float64], row: NDArray[np.float64], spraying: float) -> None:
    cos, sin = math.cos(state[HEADING]), math.sin(state[HEADING])
    row[TRACE_EAST] = state[EAST] + cos * p[P_NOZZLE_X] - sin * p[P_NOZZLE_Y]
    row[TRACE_NORTH] = state[NORTH] + sin * p[P_NOZZLE_X] + cos * p[P_NOZZLE_Y]
    row[TRACE_SPRAYING] = spraying


@kernel
def advance(
    state: NDArray[np.float64],
    p: NDArray[np.float64],
    left_radps: float,
    right_radps: float,
    valve: bool,
    disc: bool,
    seed: int,
    tick: int,
    trace: NDArray[np.float64],
) -> None:
    """Advance the world by one onboard tick of ten 1 ms steps, in place.

    Args:
        state: (STATE_SIZE,) the world, changed in place.
        p: (PARAMETER_SIZE,) constants of this vehicle and scenario.
        left_radps: Commanded wheel speed, held over the tick.
        right_radps: As `left_radps`.
        valve: Whether the valve is commanded open.
        disc: Whether the disc is commanded down.
        seed: Of the scenario.
        tick: Onboard tick, the counter of the randomness.
        trace: (STEPS + 1, 3) filled with the nozzle's positions [m] and whether paint flowed.
    """
    fresh = p[P_SLIP_SIGMA] * math.sqrt(1.0 - p[P_SLIP_DECAY] * p[P_SLIP_DECAY])
    state[LEFT_SLIP] = p[P_SLIP_DECAY] * state[LEFT_SLIP] + fresh * normal(seed, STREAM_SLIP, tick, 0)
    state[RIGHT_SLIP] = p[P_SLIP_DECAY] * state[RIGHT_SLIP] + fresh * normal(seed, STREAM_SLIP, tick, 1)
    left_grip = p[P_LEFT_RADIUS] * (1.0 - state[LEFT_SLIP])
    right_grip = p[P_RIGHT_RADIUS] * (1.0 - state[RIGHT_SLIP])
    speed_before, heading_before = state[SPEED], state[HEADING]
    lateral_accel, energy_j = 0.0, 0.0
    _trace_row(state, p, trace[0], 0.0)
    for step in range(STEPS):
        left_rate = _wheel(state[LEFT_RATE], left_radps, p)
        right_rate = _wheel(state[RIGHT_RATE], right_radps, p)
        left = 0.5 * (left_rate + state[LEFT_RATE])
        right = 0.5 * (right_rate + state[RIGHT_RATE])
        state[LEFT_RATE], state[RIGHT_RATE] = left_rate, right_rate
        state[LEFT_ANGLE] += left * STEP_S
        state[RIGHT_ANGLE] += right * STEP_S

        speed = 0.5 * (left * left_grip + right * right_grip)
        yaw_rate = (right * right_grip - left * left_grip) / p[P_TRACK]
        half_turn = 0.5 * yaw_rate * STEP_S
        chord = speed * STEP_S * (math.sin(half_turn) / half_turn if abs(half_turn) > 1e-9 else 1.0)
        state[EAST] += chord * math.cos(state[HEADING] + half_turn)
        state[NORTH] += chord * math.sin(state[HEADING] + half_turn)
        state[HEADING] += yaw_rate * STEP_S
        state[SPEED] = 0.5 * (left_rate * left_grip + right_rate * right_grip)
        state[YAW_RATE] = (right_rate * right_grip - left_rate * left_grip) / p[P_TRACK]
        lateral_accel += speed * yaw_rate

        spraying = 1.0 if state[VALVE_OPEN] > 0.0 and state[TANK_L] > 0.0 else 0.0
        state[VALVE], state[VALVE_OPEN] = _plunger(
            state[VALVE], state[VALVE_OPEN], valve, p[P_VALVE_ON], p[P_VALVE_OFF]
        )
        state[DISC], state[DISC_DOWN] = _plunger(state[DISC], state[DISC_DOWN], disc, p[P_DISC], p[P_DISC])
        state[FLOW_LPS] = spraying * p[P_FLOW_LPS]
        state[TANK_L] = max(state[TANK_L] - state[FLOW_LPS] * STEP_S, 0.0)
        energy_j += (p[P_IDLE_W] + p[P_DRIVE_W] * abs(speed)) * STEP_S
        _trace_row(state, p, trace[step + 1], spraying)
    duration = STEPS * STEP_S
    state[POWER_W] = energy_j / duration
    state[BATTERY_WH] = max(state[BATTERY_WH] - energy_j / 3600.0, 0.0)
    state[MEAN_YAW_RATE] = (state[HEADING] - heading_before) / duration
    state[MEAN_ACCEL_X] = (state[SPEED] - speed_before) / duration
    state[MEAN_ACCEL_Y] = lateral_accel / STEPS
