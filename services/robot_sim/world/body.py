"""Layouts of the world's state and nozzle-trace arrays, and the figures of a body."""

from __future__ import annotations

from typing import Final, NamedTuple

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

# Trace of the tool's point: row 0 is the tick's start, row k the state after step k.
TRACE_EAST: Final = 0
TRACE_NORTH: Final = 1
TRACE_SPRAYING: Final = 2  # share of the tool's width worked on in the step that ends in this row
TRACE_SHAPE: Final = (STEPS + 1, 3)


class BodyFigures(NamedTuple):
    """What is constant of a robot and its ground, whatever its drive and tool.

    Attributes:
        point_x_m: Where the tool works, body frame, forward.
        point_y_m: The same, to the left.
        idle_w: What the robot draws at rest.
        mass_kg: Empty.
        load_kgpl: Mass of a litre of what the tool has in its tank.
        battery_wh: Full.
        gyration_m2: Square of the radius of gyration about the vertical.
        grip: Largest force of a tyre over its load.
        stiffness_x: Its force over load per unit of slip, along.
        stiffness_y: The same across.
        rolling: Rolling resistance over load.
        slip_sigma: Random slip, a share of ground speed, 1 σ.
        slip_decay: Of the random slip in a tick, exp(−10 ms / τ).
        grade: Of the ground, rise over run.
        uphill_east: With `uphill_north` the unit vector in which it rises.
        uphill_north: See `uphill_east`.
    """

    point_x_m: float
    point_y_m: float
    idle_w: float
    mass_kg: float
    load_kgpl: float
    battery_wh: float
    gyration_m2: float
    grip: float
    stiffness_x: float
    stiffness_y: float
    rolling: float
    slip_sigma: float
    slip_decay: float
    grade: float
    uphill_east: float
    uphill_north: float
