"""State of the robot's computer from tick to tick: one record, shared by its kernels.

The layout of an array is documented in the module whose rules use it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from touchline.core.records import Record, RecordArray
from touchline.onboard import filter_model as m
from touchline.onboard.interface import (
    ACCEL,
    ACTUATORS,
    ANGLES,
    MAG,
    READINGS,
    Command,
    SensorFrame,
    standstill,
)
from touchline.onboard.tracking_state import NOW

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

FLOW_WINDOW_TICKS = 50
"""Window over which the flow of paint is evaluated."""
WAY_POSES: Final = 48
"""Number of poses along the way to come at which clearance is measured."""
NEVER_SCANNED: Final = -1_000_000


class FrameState(Record):
    """The last sensor frame without its fixes."""

    readings: Annotated[Floats, READINGS]
    """The newest samples, laid out as in `interface`."""
    imu_tick: int
    """Tick in which the IMU sample was measured."""
    mag_tick: int
    encoder_tick: int
    bumper: bool
    operator_alive: bool = True
    battery_fraction: float = 1.0
    tank_l: float

    def fill(self, frame: SensorFrame) -> None:
        """Copy the values of a frame."""
        self.readings[:ACCEL], self.readings[ACCEL:MAG] = frame.imu[:3], frame.imu[3:]
        self.readings[MAG:ANGLES], self.readings[ANGLES:] = frame.mag, frame.encoders
        self.imu_tick, self.mag_tick = frame.tick - frame.imu_age_ticks, frame.tick - frame.mag_age_ticks
        self.encoder_tick = frame.tick - frame.encoder_age_ticks
        self.bumper, self.operator_alive = frame.bumper, frame.operator_alive
        self.battery_fraction, self.tank_l = frame.battery_fraction, frame.tank_l


class CommandState(Record):
    """Command in force; fields as in `Command`."""

    actuators: Annotated[Floats, ACTUATORS]
    valve: bool
    disc: bool
    valve_after_s: float

    @property
    def standstill(self) -> Command:
        """See `interface.standstill`."""
        return standstill(len(self.actuators))

    @property
    def command(self) -> Command:
        """The same as a `Command`."""
        return Command(tuple(self.actuators.tolist()), self.valve, self.disc, self.valve_after_s)

    def give(self, command: Command) -> Command:
        """Put a command in force and return it."""
        self.actuators[:], self.valve, self.disc, self.valve_after_s = command
        return command


class SampleBuffer(Record):
    """The newest samples, and the earlier ones that they are compared with."""

    imu_tick: int = -1
    """Tick in which the newest IMU sample was measured; −1 before the first."""
    encoder_tick: int = -1
    mag_tick: int = -1
    still_ticks: int
    """Ticks since anything of the drive moved."""
    accel_mps2: float
    """Newest forward acceleration [m/s²]."""
    measured: Annotated[Floats, ACTUATORS]
    """Measured value of each actuator, in the unit of its command."""
    angles_rad: Annotated[Floats, ACTUATORS]
    """Newest encoder readings [rad]."""
    turned_rad: Annotated[Floats, ACTUATORS]
    """Change of the encoder readings since the ones before [rad]."""
    reading: Annotated[Floats, 6]
    """Newest IMU sample: gyro [rad/s] and accelerometer [m/s²]."""
    measured_then: Annotated[Floats, ACTUATORS]
    """Value of `measured` when the IMU last gave a new sample."""
    repeated: bool
    """True if the IMU has repeated that sample since."""


class FilterState(Record):
    """Memory of the filter, by tick modulo RING unless noted otherwise."""

    states: Annotated[Floats, m.RING, m.STATES]
    """Posterior states."""
    covariances: Annotated[Floats, m.RING, m.STATES, m.STATES]
    """Posterior covariances."""
    inputs: Annotated[RecordArray[m.TickInputs], m.RING]
    """Measurements other than GNSS."""
    no_inputs: m.TickInputs
    """Inputs of a tick without measurements."""
    fixes: Annotated[RecordArray[m.FixInTick], m.RING]
    """Fixes by the tick in which they are valid."""
    arrived: m.FixInTick
    """The fix that has just arrived."""
    update_rows: Annotated[Floats, m.RING, m.MOST_UPDATES, m.UPDATE_COLUMNS]
    """Scalar measurements of auxiliary sensors, by the tick in which they are valid."""
    update_counts: Annotated[Integers, m.RING]
    """Number of scalar measurements of auxiliary sensors in each tick."""
    figures: m.FilterFigures
    counters: m.FilterCounters
    learned: m.LearnedFigures
    blind: m.BlindRun


class ReceivedFix(Record):
    """A received fix or camera pose, whenever it was measured; fields as in `GnssSample`, and a heading."""

    stamp_s: float
    east_m: float
    north_m: float
    variance_m2: float
    fix: int
    satellites: int
    correction_age_s: float
    heading_rad: float
    """Heading of a camera's pose; nan for a GNSS fix."""
    heading_variance_rad2: float


class FilterTimes(Record):
    """Start and present tick of the filter, and the newest fix."""

    first_tick: int = -1
    """Tick in which the filter started; −1 before that."""
    tick: int
    last_used_stamp_s: float = -math.inf
    """Time of validity of the newest RTK-fixed position that was used [s]."""
    fix: ReceivedFix
    """Newest fix by its stamp, used or not; fixes with a stamp in the future are ignored."""
    has_fix: bool


class PoseFindings(Record):
    """Limits and results of the localization monitor."""

    needs_fixes: bool = True
    """True if the position is known from fixes, not from odometry alone."""
    fix_age_s: float
    """Largest age of the newest fix at which the robot may paint [s]."""
    sigma_m: float
    """Largest σ of the position at which the robot may paint [m]."""
    blind_sigma_m: float
    """Largest σ of the position at which the robot may drive [m]."""
    tick: int
    """Tick that was evaluated last."""
    pose: int = 1
    """Reason why the position cannot be trusted to a line's width; 0 if it can; codes of
    `executive/localization_monitor`."""
    settled_at_s: float = -math.inf
    """Time from which the position counts as good again [s]."""
    inconsistent: bool
    """`FilterCounters.inconsistent` as it has been reported."""
    differing: int
    """`FilterCounters.differing` as it has been reported."""


class SafetyFindings(Record):
    """Memory and results of the failsafe."""

    fence_timeout_s: float
    lag_share: Annotated[Floats, ACTUATORS]
    """Share of the difference to its command by which an actuator approaches it in a tick."""
    max_step: Annotated[Floats, ACTUATORS]
    """Largest change of each actuator in a tick."""
    tolerance: Annotated[Floats, ACTUATORS]
    tolerance_share: Annotated[Floats, ACTUATORS]
    """Allowed deviation from the expected value: the larger of `tolerance` and `tolerance_share` of that value."""
    nominal_l: float
    """Paint through the open valve in a tick [l]; 0 without a sprayer."""
    settle_ticks: int
    """Ticks after switching the valve until the flow has settled."""
    fence_margin_m: float
    body_radius_m: float

    outside_s: float
    """Time for which the body has been beyond the fence [s]."""
    unheard_s: float
    """Time for which the operator has not been heard [s]."""
    expected: Annotated[Floats, ACTUATORS]
    """Expected values of the actuators, from their commands."""
    astray_s: Annotated[Floats, ACTUATORS]
    """Time for which each actuator has deviated [s]."""
    tank_l: float = math.nan
    flow_l: Annotated[Floats, FLOW_WINDOW_TICKS]
    """Ring of the paint that left the tank in each tick [l]."""
    flow_first: int
    flow_count: int
    flow_sum_l: float
    valve: bool
    valve_ticks: int
    """Ticks since the valve was switched or the level was last seen to jump."""

    emergency: int
    """Reason for an emergency stop, which latches."""
    stop: int
    """Reason for a stop until `resume`."""
    lasting: int
    """The part of `stop` that can be seen at standstill, too, and prevents resuming."""
    bumper: bool
    battery_fraction: float
    dry_s: float
    """Time for which no paint, or too little, has come out of the open valve, when that is the reason for the stop
    [s]."""


class SprayState(Record):
    """Valve, and paint that falls or is owed; places are arc lengths of the nozzle."""

    on_delay_s: float
    off_delay_s: float
    last_m: float
    """Arc length up to which the valve has been decided [m]."""
    valve: bool
    """True if the valve is commanded open, at the end of the coming tick at the latest."""
    owed_from_m: float = math.nan
    """Place where paint is to begin again although the robot has passed it; nan if no paint is owed."""
    falls_from_m: float = math.inf
    falls_to_m: float = -math.inf
    """Stretch on which the paint of the open or last opened valve falls, as far as known."""
    closed: bool
    """True if the valve has been closed since `Sprayer.count_closed`."""


class LegState(Record):
    """Progress along a leg from tick to tick, and the limits of driving it."""

    end_m: float
    """Arc length at which it ends."""
    pieces_end_m: float
    """Arc length at which its smoothed pieces end."""
    authority_m: float = math.inf
    """Arc length up to which the robot may drive now, along any leg."""
    arc_m: float
    """Arc length that the robot has reached."""
    piece: int
    """Piece of the leg that the robot is on."""
    entry: int
    """Present entry of the speed profile."""
    timed: bool
    """True if the reference moves by its own time; otherwise it is where the robot is."""
    exact: bool
    """True if the robot has to rest exactly at the end; otherwise it may stop some millimetres short."""
    reference_m: float
    """Arc length that the reference has reached."""
    owed_s: float
    """Time beyond one tick by which a timed reference is to move in the next tick; at the leg's end, where it cannot
    move, the time for which it has waited there."""
    speed_mps: float
    """Reference speed along the path, negative when going back."""
    accelerate_mps2: float
    brake_mps2: float
    limit_mps: float = math.inf
    """Largest reference speed, for things in the way."""
    back_speed_mps: float
    back_to_m: float
    """Arc length to return to."""
    nozzle_x_m: float
    nozzle_y_m: float
    fine_rows: int
    """Rows of the path ahead that are a tick apart; later ones are COARSE_TICKS apart."""
    half_tick_share: float
    """Share of the difference to their commands by which the actuators approach them in half a tick."""
    now: Annotated[Floats, NOW]
    """Errors, references and the robot's own motion, laid out as in `tracking_state`."""


class WayState(Record):
    """Clearance along the way that the robot is about to take, as of the last scan, and what it allows."""

    on: bool
    """True if the robot has a lidar and is protected."""
    kind: int
    """NOT_LAID, ALONG_LEG, TURN or STRAIGHT of `protection.way`."""
    sense: float
    """Direction of the motion: that in which arc lengths or headings grow (+1), or the other one."""
    start: float
    """Arc length [m] or heading [rad] of the first pose."""
    lever_m: float
    """In turns on the spot, distance from the origin at which way and speed are measured."""
    horizon_m: float
    """Length of a way."""
    ahead_m: Annotated[Floats, WAY_POSES]
    """Way from the first pose to each."""
    east_m: Annotated[Floats, WAY_POSES]
    north_m: Annotated[Floats, WAY_POSES]
    heading_rad: Annotated[Floats, WAY_POSES]
    clear_m: Annotated[Floats, WAY_POSES]
    """Distance from the body at each to the nearest hit of a thing that may move, less what the body moves up to half
    way to the next; negative: a hit inside."""
    standing_m: Annotated[Floats, WAY_POSES]
    """The same for things that the plan knows, which stand."""
    slack_m: Annotated[Floats, WAY_POSES]
    """The part that was taken off for the motion."""
    nearest: Annotated[Integers, WAY_POSES]
    """Index of the hit that is nearest at each pose; −1 if all are out of range."""
    scan_tick: int = NEVER_SCANNED
    """Tick at whose end the oldest hit was measured."""
    error_m: float
    """Bound on the error of the hits."""
    stood_m: float = math.inf
    """Distance from the body to the nearest hit when the robot stood last; infinite once it is far enough away."""
    stop_m: float
    """Way from the first pose up to which the robot may come to rest; infinite if nothing is in the way."""
    room_m: float
    """Least clearance along the way beyond what is needed of things that stand."""
    fixed_room_m: float
    """The same for things that the plan knows."""
    slow_m: float
    """Way from the first pose to what may be ground, or a thing; infinite without any."""

    margin_m: float
    thing_mps: float
    """Highest speed of a thing that is allowed for."""
    radius_m: float
    """Distance of the body's farthest corner from its origin."""
    fastest_mps: float
    """Highest speed that is asked for."""
    planned_mps2: float
    """Deceleration with which the robot slows down for what it has seen for long."""
    braking_mps2: float
    """Deceleration of a protective stop on this ground."""
    reaction_s: float
    """Time until the robot brakes, and that of the last creep, as in `protection.stopping`."""
    creep_s: float
    lag_s: float
    """Time constant of the actuators."""
    lead_mps: float
    """Difference of the robot's speed to a command of one tick that gives this deceleration, because of the lag."""
    late_ticks: int
    """Age that hits reach before the next ones come."""
    silent_ticks: int
    """Age of the hits beyond which the lidar counts as silent."""
    free_mps: float = math.inf
    """Largest reference speed with nothing in the way; finite if the lidar does not see far enough for more."""

    limit_mps: float
    """Largest reference speed."""
    cap_mps: float
    """Speed above which the robot brakes as hard as in a protective stop."""
    blocked: int
    """Reason why the robot may not move: CLEAR, IN_THE_WAY or SILENT of `protection.way`."""


class GuidanceState(Record):
    """Motion of a guided robot from tick to tick."""

    speed_mps: float
    """Commanded speed, at least 0."""
    stands: bool
    """True if the robot has reached a target and stands."""


class TraversalClock(Record):
    """Time of a traversal."""

    tick: int
    """Last tick of the traversal."""
    elapsed_s: float
    """Sim time since the start, pauses included."""


class ComputerState(Record):
    """State of the robot's computer, all of it."""

    frame: FrameState
    buffer: SampleBuffer
    filter: FilterState
    times: FilterTimes
    pose: PoseFindings
    safety: SafetyFindings
    leg: LegState
    spray: SprayState
    command: CommandState
    guidance: GuidanceState
    way: WayState
    clock: TraversalClock


Computer = Sequence[ComputerState]
"""The state as kernels receive it, (1,)."""
