"""The state of the robot's computer from tick to tick: one record, which its kernels share.

The layout of an array is documented in the module whose rules use it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

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
"""Over which the flow of paint is judged."""


class FrameState(Record):
    """The last sensor frame, but for its fixes."""

    readings: Annotated[Floats, READINGS]
    """The newest samples, laid out as in `interface`."""
    imu_tick: int
    """In which the IMU's was measured."""
    mag_tick: int
    encoder_tick: int
    bumper: bool
    operator_alive: bool = True
    battery_fraction: float = 1.0
    tank_l: float

    def fill(self, frame: SensorFrame) -> None:
        """Take a frame's values."""
        self.readings[:ACCEL], self.readings[ACCEL:MAG] = frame.imu[:3], frame.imu[3:]
        self.readings[MAG:ANGLES], self.readings[ANGLES:] = frame.mag, frame.encoders
        self.imu_tick, self.mag_tick = frame.tick - frame.imu_age_ticks, frame.tick - frame.mag_age_ticks
        self.encoder_tick = frame.tick - frame.encoder_age_ticks
        self.bumper, self.operator_alive = frame.bumper, frame.operator_alive
        self.battery_fraction, self.tank_l = frame.battery_fraction, frame.tank_l


class CommandState(Record):
    """The command that is in force; fields as in `Command`."""

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
        """As a `Command`."""
        return Command(tuple(self.actuators.tolist()), self.valve, self.disc, self.valve_after_s)

    def give(self, command: Command) -> Command:
        """Put a command in force; returns it."""
        self.actuators[:], self.valve, self.disc, self.valve_after_s = command
        return command


class SampleBuffer(Record):
    """The newest samples, and the earlier ones that they are compared with."""

    imu_tick: int = -1
    """In which the newest sample of the IMU was measured; −1 before the first."""
    encoder_tick: int = -1
    mag_tick: int = -1
    still_ticks: int
    """For how long nothing of the drive has moved."""
    accel_mps2: float
    """The newest forward acceleration."""
    measured: Annotated[Floats, ACTUATORS]
    """What each actuator does, in the unit of its command."""
    angles_rad: Annotated[Floats, ACTUATORS]
    """The newest readings of their encoders."""
    turned_rad: Annotated[Floats, ACTUATORS]
    """Since the readings before."""
    reading: Annotated[Floats, 6]
    """The newest sample of the IMU, gyro and accelerometer."""
    measured_then: Annotated[Floats, ACTUATORS]
    """What the actuators did when the IMU last said something new."""
    repeated: bool
    """Whether it has said the same again since."""


class FilterState(Record):
    """All that the filter keeps, by tick modulo RING where not said otherwise."""

    states: Annotated[Floats, m.RING, m.STATES]
    """Posterior states."""
    covariances: Annotated[Floats, m.RING, m.STATES, m.STATES]
    """Theirs."""
    inputs: Annotated[RecordArray[m.TickInputs], m.RING]
    """Measurements but GNSS."""
    no_inputs: m.TickInputs
    """Those of a tick in which nothing was measured."""
    fixes: Annotated[RecordArray[m.FixInTick], m.RING]
    """By the tick that they are valid in."""
    arrived: m.FixInTick
    """The fix that has just arrived."""
    update_rows: Annotated[Floats, m.RING, m.MOST_UPDATES, m.UPDATE_COLUMNS]
    """Scalar measurements of auxiliary sensors, by the tick that they are valid in."""
    update_counts: Annotated[Integers, m.RING]
    """Their numbers."""
    figures: m.FilterFigures
    counters: m.FilterCounters
    learned: m.LearnedFigures


class ReceivedFix(Record):
    """A fix or a camera's pose that has arrived, whenever it was measured; fields as in `GnssSample`, and two more."""

    stamp_s: float
    east_m: float
    north_m: float
    variance_m2: float
    fix: int
    satellites: int
    correction_age_s: float
    heading_rad: float
    """nan if it has none."""
    heading_variance_rad2: float


class FilterTimes(Record):
    """When the filter started, where it is, and the newest fix."""

    first_tick: int = -1
    """In which it was started; −1: not yet."""
    tick: int
    last_used_stamp_s: float = -math.inf
    """Time of validity of the newest RTK-fixed position that was used."""
    fix: ReceivedFix
    """The newest fix that arrived, used or not; by its stamp, and not from the future."""
    has_fix: bool


class PoseFindings(Record):
    """What the monitor has found."""

    needs_fixes: bool = True
    """Whether anything tells the position but the robot's own motion."""
    fix_age_s: float
    """How old the newest fix may be to paint."""
    sigma_m: float
    """Of the position, beyond which it is too uncertain to paint."""
    blind_sigma_m: float
    """Of the position, beyond which the robot does not drive."""
    tick: int
    """That was judged last."""
    pose: int = 1
    """Why the position cannot be trusted to a line's width; 0 if it can; codes of `executive/localization_monitor`."""
    settled_at_s: float = -math.inf
    """From when on it counts as good again."""


class SafetyFindings(Record):
    """What the failsafe keeps from tick to tick, and what it has found."""

    fence_timeout_s: float
    lag_share: Annotated[Floats, ACTUATORS]
    """By which share of the difference an actuator gets nearer to its command in a tick."""
    max_step: Annotated[Floats, ACTUATORS]
    """By how much it changes in a tick at most."""
    tolerance: Annotated[Floats, ACTUATORS]
    tolerance_share: Annotated[Floats, ACTUATORS]
    """By how much it may differ from what is expected: the larger of both."""
    nominal_l: float
    """Paint through the open valve in a tick; 0 without a sprayer."""
    settle_ticks: int
    """After the valve has switched, until the flow is what it is to be."""
    fence_margin_m: float
    body_radius_m: float

    outside_s: float
    """For how long the body has been beyond the fence."""
    unheard_s: float
    """For how long the operator has not been heard."""
    expected: Annotated[Floats, ACTUATORS]
    """What the actuators should do by their commands."""
    astray_s: Annotated[Floats, ACTUATORS]
    """For how long each has done something else."""
    tank_l: float = math.nan
    flow_l: Annotated[Floats, FLOW_WINDOW_TICKS]
    """Ring of what has left the tank in each tick."""
    flow_first: int
    flow_count: int
    flow_sum_l: float
    valve: bool
    valve_ticks: int
    """Since it switched, or since the level was last seen to jump."""

    emergency: int
    """Why to stop as hard as possible and latch."""
    stop: int
    """Why to stop until told to resume."""
    lasting: int
    """The part of `stop` that can be seen at standstill, too, and speaks against going on."""
    bumper: bool
    battery_fraction: float
    dry_s: float
    """For how long no paint, or too little, has come out of the open valve, when that is why to stop."""


class SprayState(Record):
    """The valve, and what falls or is owed; places are arc lengths of the nozzle."""

    on_delay_s: float
    off_delay_s: float
    last_m: float
    """Up to which it has been decided."""
    valve: bool
    """Whether it is commanded open, at the end of the coming tick at the latest."""
    owed_from_m: float = math.nan
    """Where paint is to begin again, although the robot has passed; nan if nothing is owed."""
    falls_from_m: float = math.inf
    falls_to_m: float = -math.inf
    """Where the paint of the open or last opened valve falls: from → to, as far as known."""
    closed: bool
    """Whether it has been closed since `Sprayer.count_closed`."""


class LegState(Record):
    """How the robot drives a leg: progress from tick to tick, and by what limits."""

    end_m: float
    """Arc length at which it ends."""
    pieces_end_m: float
    """Arc length at which its smoothed pieces end."""
    authority_m: float = math.inf
    """Arc length up to which the robot may drive now, along any leg."""
    arc_m: float
    """Arc length that the robot has come to."""
    piece: int
    """Of the leg, that it is on."""
    entry: int
    """Of the speed profile."""
    timed: bool
    """Whether the reference moves by its own time; else it is where the robot is."""
    exact: bool
    """Whether it matters where the robot rests at the end; else it may stop some millimetres short."""
    reference_m: float
    """Arc length that the reference has come to."""
    owed_s: float
    """By how much more than a tick a timed reference is to move in the next one; at the leg's end, where it cannot, how
    long it has waited there."""
    speed_mps: float
    """Reference speed along the path, negative when going back."""
    accelerate_mps2: float
    brake_mps2: float
    back_speed_mps: float
    back_to_m: float
    """Arc length to return to."""
    nozzle_x_m: float
    nozzle_y_m: float
    fine_rows: int
    """Rows of the path ahead that are a tick apart; later ones are COARSE_TICKS apart."""
    half_tick_share: float
    """By which share of the difference the actuators get nearer to their command in half a tick."""
    now: Annotated[Floats, NOW]
    """Errors, references and the robot's own motion, laid out as in `tracking_state`."""


class GuidanceState(Record):
    """How a guided robot drives, from tick to tick."""

    speed_mps: float
    """That is commanded, at least 0."""
    stands: bool
    """Whether it has come to a target and stands."""


class TraversalClock(Record):
    """The time of a traversal."""

    tick: int
    """The last one."""
    elapsed_s: float
    """Sim time since the start, pauses included."""


class ComputerState(Record):
    """See the module."""

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
    clock: TraversalClock


Computer = Sequence[ComputerState]
"""(1,) the state, as kernels are given it."""
