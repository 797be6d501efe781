"""The localization monitor: whether the pose is good enough to drive, and to paint."""

from __future__ import annotations

import math

from touchline.schemas.onboard import GnssSheet
from touchline.services.onboard.estimation import model as m
from touchline.services.onboard.estimation.filter import FIX_FIXED, Estimator
from touchline.services.onboard.interface import TICK_S

MAX_FIX_AGE_S = 0.5
"""To paint; more for a receiver whose fixes are older than that before the next but one can come."""
MAX_CORRECTION_AGE_S = 10.0
MAX_POSITION_SIGMA_M = 0.025
MAX_HEADING_SIGMA_RAD = math.radians(1.0)
MAX_NIS = 4.4
"""Of the running mean over about ten fixes, each as it is weighed: 2 is expected of a consistent filter, 5.5 is the
most that there is. An unweighed 6 of every fix makes so much."""
MAX_LATERAL_M = 0.03
MAX_BLIND_SIGMA_M = 0.15
"""Position σ beyond which the robot does not even drive."""
MAX_SILENCE_TICKS = 20
"""Without a new sample of the IMU or the encoders, to paint; driving stops after half a second."""
MAX_BLIND_TICKS = 50
MAX_SLIP = 0.5
"""Share of the last 0.3 s of wheel readings that contradict IMU and GNSS."""
SETTLE_S = 1.0
"""How long all must have been well again before painting goes on."""
SLIP_SETTLE_S = 5.0
"""The same after the wheels slipped, which only driving can show: a robot that stands turns no wheel, so all seems well
at once whatever the cause, and all tries would be spent while that lasts."""

CONTRADICTION = "the fixes contradict the estimate"
SLIP = "the wheels slip: they contradict the other sensors"
FIX_NAMES = {0: "no fix", 1: "a single fix", 2: "a float fix"}


def max_fix_age_s(gnss: GnssSheet) -> float:
    """How old the newest fix may be to paint, for this receiver: one of its fixes may stay away, but not two."""
    return max(MAX_FIX_AGE_S, 2.0 / gnss.rate_hz + gnss.latency_s + gnss.latency_jitter_s + 2.0 * TICK_S)


class LocalizationMonitor:
    """Judges every tick; says why not.

    Args:
        estimator: That is watched.
        fix_age_s: How old its newest fix may be to paint.

    Attributes:
        pose_problem: Why the position cannot be trusted to a line's width, "" if it can.
    """

    def __init__(self, estimator: Estimator, fix_age_s: float = MAX_FIX_AGE_S) -> None:
        self._estimator = estimator
        self.fix_age_s = fix_age_s
        self.pose_problem = "the estimator has not started"
        self._settled_at_s = -math.inf
        self._tick = 0

    def look(self, tick: int, time_s: float) -> None:
        """Judge the tick."""
        self._tick = tick
        self.pose_problem = self._pose_problem(time_s)
        if self.pose_problem:
            settle_s = SLIP_SETTLE_S if self.pose_problem == SLIP else SETTLE_S
            self._settled_at_s = max(self._settled_at_s, time_s + settle_s)

    def settled(self, time_s: float) -> bool:
        """Whether the pose has been good for `SETTLE_S`, or `SLIP_SETTLE_S` if the wheels slipped."""
        return not self.pose_problem and time_s >= self._settled_at_s

    def heading_problem(self) -> str:
        """Why the heading is not good enough to paint, "" if it is. Only driving makes it better."""
        sigma = self._estimator.heading_sigma_rad
        if sigma > MAX_HEADING_SIGMA_RAD:
            return f"the heading is uncertain (σ above {math.degrees(MAX_HEADING_SIGMA_RAD):.1f}°)"
        return ""

    def paint_problem(self, nozzle_lateral_m: float) -> str:
        """Why not to paint here and now, "" if nothing speaks against it."""
        if self.pose_problem:
            return self.pose_problem
        if abs(nozzle_lateral_m) > MAX_LATERAL_M:
            return f"the nozzle is off its line by more than {MAX_LATERAL_M * 1e3:.0f} mm"
        return self.heading_problem()

    def drive_problem(self) -> str:
        """Why not to drive at all, "" if nothing speaks against it."""
        if self._estimator.contradicted:
            return CONTRADICTION
        sigma = self._estimator.position_sigma_m
        if sigma > MAX_BLIND_SIGMA_M:
            return f"the position is unknown (σ above {MAX_BLIND_SIGMA_M:.2f} m)"
        return self._silence(MAX_BLIND_TICKS)

    def accepts_jump(self) -> bool:
        """Whether nothing but a jump speaks against the receiver: it is fixed, corrected and fresh."""
        return self.pose_problem == CONTRADICTION

    def _pose_problem(self, time_s: float) -> str:
        estimator = self._estimator
        fix = estimator.last_fix
        if not estimator.started or fix is None:
            return "the estimator has not started"
        if fix.fix != FIX_FIXED:
            return f"the GNSS has {FIX_NAMES.get(fix.fix, 'an unknown fix')} instead of an RTK-fixed one"
        if fix.correction_age_s > MAX_CORRECTION_AGE_S:
            return f"the RTK corrections are older than {MAX_CORRECTION_AGE_S:.0f} s"
        if time_s - fix.stamp_s > self.fix_age_s:
            return f"there has been no fix for more than {self.fix_age_s:.1f} s"
        if estimator.contradicted:
            return CONTRADICTION
        if time_s - estimator.last_used_stamp_s > self.fix_age_s:
            return f"no fix has been usable for more than {self.fix_age_s:.1f} s"
        if estimator.counters[m.NIS_FIX_RECENT] > MAX_NIS:
            return "the fixes scatter more than the estimator can explain"
        if estimator.position_sigma_m > MAX_POSITION_SIGMA_M:
            return f"the position is uncertain (σ above {MAX_POSITION_SIGMA_M * 1e3:.0f} mm)"
        if estimator.counters[m.ENCODER_REJECTED_RECENT] > MAX_SLIP:
            return SLIP
        return self._silence(MAX_SILENCE_TICKS)

    def _silence(self, ticks: int) -> str:
        intake = self._estimator.intake
        for name, newest in (("IMU's samples", intake.imu_tick), ("wheel encoders' samples", intake.encoder_tick)):
            if self._tick - newest > ticks:
                return f"the {name} are older than {ticks / 100:.1f} s"
        return ""
