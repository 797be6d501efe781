"""What is true about a robot's body, its figures, and the layout of the trace of its tool."""

from __future__ import annotations

from typing import Annotated, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.core.records import Record
from touchline.onboard.interface import ACTUATORS

STEP_S: Final = 0.001
"""Physics step [s]."""
STEPS: Final = 10
"""Physics steps of one kernel call."""

# Trace of the tool's point: row 0 is the tick's start, row k the state after step k.
TRACE_EAST: Final = 0
TRACE_NORTH: Final = 1
TRACE_SPRAYING: Final = 2  # share of the tool's width worked on in the step that ends in this row
TRACE_SHAPE: Final = (STEPS + 1, 3)


class BodyState(Record):
    """What is true about a robot, whatever its drive."""

    east_m: float
    """Of the body's origin, as `north_m`, map frame."""
    north_m: float
    heading_rad: float
    """Not wrapped."""
    speed_mps: float
    """Of the body's origin, forward."""
    side_speed_mps: float
    """The same, to the left."""
    yaw_rate_radps: float
    angles_rad: Annotated[NDArray[np.float64], ACTUATORS]
    """Of the drive's actuators, in its order, as their encoders see them: cumulative."""
    valve: float
    """Its plunger's position, 0 closed … 1 open."""
    valve_open: bool
    disc: float
    """The discs' position, 0 up … 1 down."""
    disc_down: bool
    tank_l: float
    battery_wh: float
    tank_reserve_l: float
    """What a fault keeps from use."""
    battery_reserve_wh: float
    """As `tank_reserve_l`."""
    flow_lps: float
    power_w: float
    mean_yaw_rate_radps: float
    """Over the tick: what a rate-integrating gyro sees."""
    mean_accel_x_mps2: float
    """Over the tick, forward: the specific force that an accelerometer sees, gravity on a slope included."""
    mean_accel_y_mps2: float
    """The same, to the left."""
    up_x: float
    """With `up_y` and `up_z` the vertical in body axes: 0, 0, 1 on level ground."""
    up_y: float
    up_z: float
    height_m: float
    """Above the plane of the origin."""


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
