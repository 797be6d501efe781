"""Layouts of the world's state, parameter and nozzle-trace arrays."""

from __future__ import annotations

from typing import Final

from touchline.services.onboard.interface import ACTUATORS

STEP_S: Final = 0.001
"""Physics step [s]."""
STEPS: Final = 10
"""Physics steps of one kernel call."""

# State vector; what the drive has of its own follows from `DRIVE` on.
EAST: Final = 0
NORTH: Final = 1
HEADING: Final = 2  # rad, unwrapped
SPEED: Final = 3  # m/s, of the body's origin, forward
SIDE_SPEED: Final = 4  # m/s, to the left
YAW_RATE: Final = 5  # rad/s
ANGLES: Final = 6  # of the drive's actuators, in its order, as their encoders see them: cumulative [rad]
VALVE: Final = ANGLES + ACTUATORS  # plunger position, 0 closed … 1 open
VALVE_OPEN: Final = VALVE + 1  # 0 or 1
DISC: Final = VALVE + 2
DISC_DOWN: Final = VALVE + 3
TANK_L: Final = VALVE + 4
BATTERY_WH: Final = VALVE + 5
TANK_RESERVE_L: Final = VALVE + 6  # what a fault keeps from use
BATTERY_RESERVE_WH: Final = VALVE + 7
FLOW_LPS: Final = VALVE + 8
POWER_W: Final = VALVE + 9
MEAN_YAW_RATE: Final = VALVE + 10  # over the tick: what a rate-integrating gyro sees
MEAN_ACCEL_X: Final = VALVE + 11  # specific force: what an accelerometer sees, gravity on a slope included
MEAN_ACCEL_Y: Final = VALVE + 12
UP_X: Final = VALVE + 13  # the vertical in body axes: 0, 0, 1 on level ground
UP_Y: Final = VALVE + 14
UP_Z: Final = VALVE + 15
HEIGHT: Final = VALVE + 16  # m above the plane of the origin
DRIVE: Final = VALVE + 17

# Parameter vector; the drive's own follow from `P_DRIVE` on.
P_POINT_X: Final = 0  # where the tool works
P_POINT_Y: Final = 1
P_VALVE_ON: Final = 2  # plunger travel in one step
P_VALVE_OFF: Final = 3
P_DISC: Final = 4
P_FLOW_LPS: Final = 5
P_IDLE_W: Final = 6
P_MASS: Final = 7  # kg, empty
P_PAINT_KGPL: Final = 8
P_BATTERY_WH: Final = 9  # full
P_GYRATION2: Final = 10  # m²
P_GRIP: Final = 11
P_STIFFNESS_X: Final = 12
P_STIFFNESS_Y: Final = 13
P_ROLLING: Final = 14
P_SLIP_SIGMA: Final = 15
P_SLIP_DECAY: Final = 16  # per tick, exp(−10 ms / τ)
P_GRADE: Final = 17  # rise over run
P_UPHILL_EAST: Final = 18  # unit vector
P_UPHILL_NORTH: Final = 19
P_DRIVE: Final = 20

# Trace of the tool's point: row 0 is the tick's start, row k the state after step k.
TRACE_EAST: Final = 0
TRACE_NORTH: Final = 1
TRACE_SPRAYING: Final = 2  # share of the tool's width worked on in the step that ends in this row
TRACE_SHAPE: Final = (STEPS + 1, 3)
