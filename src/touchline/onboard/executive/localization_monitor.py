"""Localization monitor: evaluates whether the pose is good enough to drive, and to paint."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from touchline.core.jit import kernel
from touchline.onboard.computer_state import Computer, ComputerState
from touchline.onboard.estimation.aiding.gnss_aiding import FIX_FIXED
from touchline.onboard.estimation.claimed_covariance import claimed_position_sigma, course_sigma
from touchline.onboard.estimation.tail import CONTRADICTED
from touchline.onboard.interface import TICK_S, TICKS_PER_S
from touchline.schemas.onboard import CameraSheet, GnssSheet, OnboardConfig
from touchline.schemas.vehicles import GNSS, ODOMETRY, OVERHEAD_CAMERA, Positioning, Vehicle

MAX_FIX_AGE_S = 0.5
"""Largest age of a fix to paint; more for a receiver whose fixes are older than that before the next but one can
arrive."""
MAX_CORRECTION_AGE_S = 10.0
MAX_POSITION_SIGMA_M = 0.025
MAX_HEADING_SIGMA_RAD = math.radians(1.0)
MAX_NIS = 4.4
"""Limit of the running mean over about ten fixes, each as it is weighed: 2 is expected of a consistent filter, 5.5 is
the largest possible value. An unweighed 6 of every fix gives about this limit."""
MAX_LATERAL_M = 0.03
MAX_BLIND_SIGMA_M = 0.15
"""Position σ beyond which the robot does not even drive."""
MAX_COVERING_SIGMA_M = 0.05
"""The same with a tool that works wherever it goes: neighbouring lanes overlap by little more than half of that."""
MAX_SILENCE_TICKS = 20
"""Ticks without a new sample of the IMU or the encoders after which painting stops; driving stops after half a
second."""
MAX_BLIND_TICKS = 50
MAX_SLIP = 0.5
"""Share of the last 0.3 s of wheel readings that contradict IMU and GNSS."""
SETTLE_S = 1.0
"""Time for which everything must have been good again before painting continues."""
SLIP_SETTLE_S = 5.0
"""The same after the wheels slipped, which only driving can show: a standing robot turns no wheel, so all seems well at
once whatever the cause, and all tries would be spent while it persists."""

# Problems of the pose, the worst first: the first that applies is reported.
GOOD: Final = 0
NOT_STARTED: Final = 1
NOT_FIXED: Final = 2
OLD_CORRECTIONS: Final = 3
NO_FIX: Final = 4
CONTRADICTION: Final = 5
UNUSABLE_FIXES: Final = 6
SCATTER: Final = 7
UNCERTAIN: Final = 8
SLIP: Final = 9
IMU_SILENT: Final = 10
ENCODERS_SILENT: Final = 11
# Further reasons not to paint here, or not to drive at all.
OFF_LINE: Final = 12
HEADING_UNCERTAIN: Final = 13
UNKNOWN: Final = 14

FIX_NAMES = {0: "no fix", 1: "a single fix", 2: "a float fix"}


def max_fix_age_s(sheet: GnssSheet | CameraSheet) -> float:
    """Return the largest age of the newest fix or pose to paint with this data sheet: one may be missing, not two."""
    return max(MAX_FIX_AGE_S, 2.0 / sheet.rate_hz + sheet.latency_s + sheet.latency_jitter_s + 2.0 * TICK_S)


class PoseLimits(NamedTuple):
    """Limits within which a robot drives and paints.

    Attributes:
        positioning: Source of the position.
        fix_age_s: Largest age of its newest fix, or pose of a camera, to paint.
        sigma_m: Position σ beyond which it does not paint.
        blind_sigma_m: Position σ beyond which it does not drive.
    """

    positioning: Positioning = GNSS
    fix_age_s: float = MAX_FIX_AGE_S
    sigma_m: float = MAX_POSITION_SIGMA_M
    blind_sigma_m: float = MAX_BLIND_SIGMA_M


def pose_limits(vehicle: Vehicle, config: OnboardConfig) -> PoseLimits:
    """Return the limits of a vehicle.

    With odometry alone no fix is missed, and a robot that does not paint may become uncertain.

    Args:
        vehicle: Gives the positioning and the tool.
        config: Gives the data sheets.
    """
    if vehicle.positioning == ODOMETRY:
        most_m = math.inf if config.odometry.max_sigma_m is None else config.odometry.max_sigma_m
        return PoseLimits(ODOMETRY, math.inf, MAX_POSITION_SIGMA_M if vehicle.tool.paints else most_m, most_m)
    sheet = config.camera if vehicle.positioning == OVERHEAD_CAMERA else config.gnss
    blind_sigma_m = MAX_COVERING_SIGMA_M if vehicle.tool.covers else MAX_BLIND_SIGMA_M
    return PoseLimits(vehicle.positioning, max_fix_age_s(sheet), blind_sigma_m=blind_sigma_m)


@kernel
def evaluate_pose(tick: int, computer: Computer) -> None:
    """Evaluate whether the pose of a tick is good to a line's width, and when it is to count as settled.

    Args:
        tick: Tick that the estimator has seen.
        computer: (1,) the findings `pose` are updated.
    """
    c = computer[0]
    c.pose.tick, c.pose.pose = tick, _pose(tick, c)
    if c.pose.pose != GOOD:
        settle_s = SLIP_SETTLE_S if c.pose.pose == SLIP else SETTLE_S
        c.pose.settled_at_s = max(c.pose.settled_at_s, tick / TICKS_PER_S + settle_s)


@kernel
def _pose(tick: int, c: ComputerState) -> int:
    times, n, time_s = c.times, c.filter.counters, tick / TICKS_PER_S
    if times.first_tick < 0:
        return NOT_STARTED
    if c.pose.needs_fixes:
        problem = _fixes(time_s, c)
        if problem != GOOD:
            return int(problem)
    if claimed_position_sigma(c) > c.pose.sigma_m:
        return UNCERTAIN
    if n.encoders_rejected_recent > MAX_SLIP:
        return SLIP
    return int(_silence(tick, c, MAX_SILENCE_TICKS))


@kernel
def _fixes(time_s: float, c: ComputerState) -> int:
    times, n = c.times, c.filter.counters
    if not times.has_fix:
        return NOT_STARTED
    if times.fix.fix != FIX_FIXED:
        return NOT_FIXED
    if times.fix.correction_age_s > MAX_CORRECTION_AGE_S:
        return OLD_CORRECTIONS
    if time_s - times.fix.stamp_s > c.pose.fix_age_s:
        return NO_FIX
    if n.fix_doubt >= CONTRADICTED:
        return CONTRADICTION
    if time_s - times.last_used_stamp_s > c.pose.fix_age_s:
        return UNUSABLE_FIXES
    return SCATTER if n.fix_nis_recent > MAX_NIS else GOOD


@kernel
def _silence(tick: int, c: ComputerState, ticks: int) -> int:
    if tick - c.buffer.imu_tick > ticks:
        return IMU_SILENT
    return ENCODERS_SILENT if tick - c.buffer.encoder_tick > ticks else GOOD


@kernel
def speaks_against_driving(computer: Computer) -> int:
    """Return the reason not to drive at all after the tick that was evaluated last; GOOD if there is none."""
    c = computer[0]
    if c.filter.counters.fix_doubt >= CONTRADICTED:
        return CONTRADICTION
    blind = c.times.first_tick < 0
    if blind or claimed_position_sigma(c) > c.pose.blind_sigma_m:
        return UNKNOWN
    return int(_silence(c.pose.tick, c, MAX_BLIND_TICKS))


@kernel
def has_news_of_itself(computer: Computer) -> bool:
    """Return whether the estimator has found something about itself, or the robot's files, that is not reported yet."""
    c = computer[0]
    n = c.filter.counters
    news: bool = n.inconsistent != c.pose.inconsistent or n.differing != c.pose.differing
    return news


@kernel
def speaks_against_painting(computer: Computer, nozzle_lateral_m: float) -> int:
    """Return the reason not to paint here and now; GOOD if there is none.

    Args:
        computer: (1,) whose tick has been evaluated; only driving improves the heading.
        nozzle_lateral_m: Distance of the nozzle to the left of its path.
    """
    c = computer[0]
    if c.pose.pose != GOOD:
        return int(c.pose.pose)
    if abs(nozzle_lateral_m) > MAX_LATERAL_M:
        return OFF_LINE
    return HEADING_UNCERTAIN if course_sigma(c) > MAX_HEADING_SIGMA_RAD else GOOD


_USUAL: Final = PoseLimits()


class LocalizationMonitor:
    """Monitor that evaluates in every tick whether the pose is good enough to drive and to paint, with reasons.

    Args:
        computer: State with the estimate.
        limits: Limits of the robot.

    Attributes:
        findings: Findings of the last tick.
        source: Source of the position, for people.
    """

    def __init__(self, computer: ComputerState, limits: PoseLimits = _USUAL) -> None:
        self._computer, self.findings = computer, computer.pose
        found, (positioning, found.fix_age_s, found.sigma_m, found.blind_sigma_m) = self.findings, limits
        found.needs_fixes = positioning != ODOMETRY
        seen = positioning == OVERHEAD_CAMERA
        self.source = "camera" if seen else "receiver"
        self._fix, self._fixes = ("camera pose", "camera's poses") if seen else ("fix", "fixes")

    def look(self, tick: int) -> None:
        """Evaluate a tick."""
        evaluate_pose(tick, self._computer.array)

    @property
    def pose_problem(self) -> str:
        """Reason why the position cannot be trusted to a line's width, "" if it can."""
        return self._words(self.findings.pose, MAX_SILENCE_TICKS)

    def settled(self, time_s: float) -> bool:
        """Return True if the pose has been good for `SETTLE_S`, or `SLIP_SETTLE_S` if the wheels slipped."""
        return self.findings.pose == GOOD and time_s >= self.findings.settled_at_s

    def paint_problem(self, nozzle_lateral_m: float) -> str:
        """Return the reason not to paint here and now, "" if there is none."""
        code = speaks_against_painting(self._computer.array, nozzle_lateral_m)
        return self._words(code, MAX_SILENCE_TICKS)

    def drive_problem(self) -> str:
        """Return the reason not to drive at all, "" if there is none."""
        code = speaks_against_driving(self._computer.array)
        return self._words(code, MAX_BLIND_TICKS)

    def accepts_jump(self) -> bool:
        """Return True if a jump is the only problem of the receiver: it is fixed, corrected and fresh."""
        return self.findings.pose == CONTRADICTION

    def _words(self, code: int, silent_ticks: int) -> str:
        """Return the text about a finding; "" if all is well."""
        if code == GOOD:
            return ""
        if code == NOT_FIXED:
            fix = self._computer.times.fix.fix
            return f"the GNSS has {FIX_NAMES.get(fix, 'an unknown fix')} instead of an RTK-fixed one"
        silence = f"are older than {silent_ticks / TICKS_PER_S:.1f} s"
        inconsistent = self._computer.filter.counters.inconsistent
        doubt = ", which is inconsistent: are the robot's files right?" if inconsistent else ""
        age = f"for more than {self.findings.fix_age_s:.1f} s"
        return {
            NOT_STARTED: "the estimator has not started",
            OLD_CORRECTIONS: f"the RTK corrections are older than {MAX_CORRECTION_AGE_S:.0f} s",
            NO_FIX: f"there has been no {self._fix} {age}",
            CONTRADICTION: f"the {self._fixes} contradict the estimate{doubt}",
            UNUSABLE_FIXES: f"no {self._fix} has been usable {age}",
            SCATTER: f"the {self._fixes} scatter more than the estimator can explain",
            UNCERTAIN: f"the position is uncertain (σ above {self.findings.sigma_m * 1e3:.0f} mm)",
            SLIP: "the wheels slip: they contradict the other sensors",
            IMU_SILENT: f"the IMU's samples {silence}",
            ENCODERS_SILENT: f"the wheel encoders' samples {silence}",
            OFF_LINE: f"the nozzle is off its line by more than {MAX_LATERAL_M * 1e3:.0f} mm",
            HEADING_UNCERTAIN: f"the heading is uncertain (σ above {math.degrees(MAX_HEADING_SIGMA_RAD):.1f}°)",
            UNKNOWN: f"the position is unknown (σ above {self.findings.blind_sigma_m:.2f} m)",
        }[code]
