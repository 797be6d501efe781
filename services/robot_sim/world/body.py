"""True state of a robot's body, its parameters, and the layout of the trace of its tool."""

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
STANDS_MPS: Final = 0.02
"""Speed below which a robot stands, as far as a dock is concerned."""

# Trace of the tool's point: row 0 is the tick's start, row k the state after step k.
TRACE_EAST: Final = 0
TRACE_NORTH: Final = 1
TRACE_SPRAYING: Final = 2  # share of the tool's width worked on in the step that ends in this row
TRACE_SHAPE: Final = (STEPS + 1, 3)


class BodyState(Record):
    """True state of a robot, whatever its drive."""

    east_m: float
    """East of the body's origin, map frame; `north_m` likewise."""
    north_m: float
    heading_rad: float
    """Not wrapped."""
    speed_mps: float
    """Forward speed of the body's origin."""
    side_speed_mps: float
    """Speed of the body's origin to the left."""
    yaw_rate_radps: float
    angles_rad: Annotated[NDArray[np.float64], ACTUATORS]
    """Cumulative angles of the drive's actuators, in its order, as their encoders read them."""
    valve: float
    """Position of the valve's plunger, 0 closed … 1 open."""
    valve_open: bool
    disc: float
    """Position of the discs, 0 up … 1 down."""
    disc_down: bool
    tank_l: float
    battery_wh: float
    tank_reserve_l: float
    """Paint that a fault withholds."""
    battery_reserve_wh: float
    """Charge that a fault withholds."""
    flow_lps: float
    power_w: float
    mean_yaw_rate_radps: float
    """Mean over the tick, as a rate-integrating gyro measures it."""
    mean_accel_x_mps2: float
    """Mean over the tick, forward: the specific force that an accelerometer measures, gravity on a slope included."""
    mean_accel_y_mps2: float
    """The same, to the left."""
    up_x: float
    """Vertical in body axes, with `up_y` and `up_z`: 0, 0, 1 on level ground."""
    up_y: float
    up_z: float
    height_m: float
    """Height above the plane of the origin."""
    bumper: bool
    """True if a thing pressed the bumper in the last tick."""
    wander_rad: float
    """Random part of the angle of the motion beyond the heading."""
    mean_roll_rate_radps: float
    """Mean over the tick about x, as `mean_yaw_rate_radps`; the next is that about y."""
    mean_pitch_rate_radps: float
    climb_mps: float
    """Mean change of the height over the tick, on rough ground."""
    mean_accel_z_mps2: float
    """Mean over the tick, up, gravity apart, on rough ground."""
    patch_slip: Annotated[NDArray[np.float64], 2]
    """Share of ground speed that the left and the right side lose at this place."""


class BodyFigures(NamedTuple):
    """Constants of a robot and its ground, whatever its drive and tool.

    Attributes:
        point_x_m: Working point of the tool, body frame, forward.
        point_y_m: The same, to the left.
        idle_w: Power that the robot draws at rest.
        mass_kg: Empty mass.
        load_kgpl: Mass of a litre in the tool's tank.
        battery_wh: Charge of the full battery.
        gyration_m2: Square of the radius of gyration about the vertical.
        grip: Largest force of a tyre over its load.
        stiffness_x: Longitudinal force over load per unit of slip.
        stiffness_y: The same, lateral.
        rolling: Rolling resistance over load.
        slip_sigma: Random slip, a share of ground speed, 1 σ.
        slip_decay: Share of the random slip that remains after a tick, exp(−10 ms / τ).
        grade: Slope of the ground, rise over run.
        uphill_east: Unit vector uphill, with `uphill_north`.
        uphill_north: See `uphill_east`.
        crab_rad: Constant part of the angle of the motion beyond the heading.
        wander_rad: Random part of it, 1 σ.
        wander_1pm: Reciprocal of the length over which that is correlated.
        drift_east_m: Place of the paint east of the nozzle's.
        drift_north_m: The same, north.
        docks: (d, 4) place of each dock (x, y), its reach [m], and its power [W].
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
    crab_rad: float
    wander_rad: float
    wander_1pm: float
    drift_east_m: float
    drift_north_m: float
    docks: NDArray[np.float64]
