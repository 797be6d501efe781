"""Layouts of the world's state, parameter and nozzle-trace arrays."""

from __future__ import annotations

from typing import Final

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
SPEED: Final = 7  # m/s, of the axle centre, forward
YAW_RATE: Final = 8  # rad/s
LEFT_SLIP: Final = 9  # random share of ground speed lost; the tyres' own slip comes on top
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
MEAN_ACCEL_X: Final = 20  # specific force: what an accelerometer sees, gravity on a slope included
MEAN_ACCEL_Y: Final = 21
SIDE_SPEED: Final = 22  # m/s, to the left
REFERENCE: Final = 23  # left, right: the drives' speed profile [rad/s]
TORQUE: Final = 25  # left, right: of the motors at the wheels [Nm]
INTEGRAL: Final = 27  # left, right: of the drives' controllers [Nm]
CASTER_X: Final = 29  # direction in which the casters roll, body frame, unit vector
CASTER_Y: Final = 30
UP_X: Final = 31  # the vertical in body axes: 0, 0, 1 on level ground
UP_Y: Final = 32
UP_Z: Final = 33
HEIGHT: Final = 34  # m above the plane of the origin
TANK_RESERVE_L: Final = 35  # what a fault keeps from use
BATTERY_RESERVE_WH: Final = 36
LEFT_TRACTION: Final = 37  # N, of the tyres, in the last step
RIGHT_TRACTION: Final = 38
STATE_SIZE: Final = 39

# Parameter vector.
P_LEFT_RADIUS: Final = 0
P_RIGHT_RADIUS: Final = 1
P_TRACK: Final = 2
P_MAX_RATE: Final = 3
P_MAX_ACCEL: Final = 4
P_LAG: Final = 5  # share of the way to the command in one step
P_SLIP_SIGMA: Final = 6
P_SLIP_DECAY: Final = 7  # per tick, exp(−10 ms / τ)
P_NOZZLE_X: Final = 8
P_NOZZLE_Y: Final = 9
P_VALVE_ON: Final = 10  # plunger travel in one step
P_VALVE_OFF: Final = 11
P_DISC: Final = 12
P_FLOW_LPS: Final = 13
P_IDLE_W: Final = 14
P_MASS: Final = 15  # kg, empty
P_PAINT_KGPL: Final = 16
P_GYRATION2: Final = 17  # m²
P_WHEEL_INERTIA: Final = 18  # kg m², motor's share included
P_TORQUE_PER_A: Final = 19  # Nm/A at the wheel, gear losses taken off
P_EMF: Final = 20  # V per rad/s of the wheel
P_RESISTANCE: Final = 21  # Ω
P_MAX_CURRENT: Final = 22
P_CURRENT_LAG: Final = 23  # share of the way to the demanded torque in one step
P_FRICTION: Final = 24  # Nm, dry
P_VISCOUS: Final = 25  # Nm per rad/s
P_GAIN: Final = 26  # Nm per rad/s
P_INTEGRAL_GAIN: Final = 27  # Nm per rad
P_AHEAD_COMMON: Final = 28  # Nm per rad/s²: feed-forward of both wheels speeding up together
P_AHEAD_TURN: Final = 29  # and against each other
P_GRIP: Final = 30
P_STIFFNESS_X: Final = 31
P_STIFFNESS_Y: Final = 32
P_ROLLING: Final = 33
P_CASTER_X: Final = 34
P_CASTER_SHARE: Final = 35
P_CASTER_TRAIL: Final = 36
P_GRADE: Final = 37  # rise over run
P_UPHILL_EAST: Final = 38  # unit vector
P_UPHILL_NORTH: Final = 39
P_BATTERY_WH: Final = 40  # full
PARAMETER_SIZE: Final = 41

# Trace of the nozzle: row 0 is the tick's start, row k the state after step k.
TRACE_EAST: Final = 0
TRACE_NORTH: Final = 1
TRACE_SPRAYING: Final = 2  # share of the spray width painted in the step that ends in this row; 0 without paint
TRACE_SHAPE: Final = (STEPS + 1, 3)
