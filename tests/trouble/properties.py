"""Properties that every drive has, each a small class: what it sees at each look, and at the end.

A property that is broken raises `Trouble` with its name and the figures. What a robot cannot know of itself (where
its nozzle or the base station really is) is allowed for; so is what a fault does to the very thing it is about.
"""

import math
from typing import Final

import numpy as np

from benchmarks._true_paint import RASTER_M, longest_m, painted_cells
from tests.trouble.case import Case
from tests.trouble.drive import VEHICLE, Driven, Look
from touchline.schemas.messages import Event, TraversalStatus

RUNNING, PAUSED, DONE = TraversalStatus.RUNNING, TraversalStatus.PAUSED, TraversalStatus.DONE
ABORTED, ESTOPPED = TraversalStatus.ABORTED, TraversalStatus.ESTOPPED
ENDED: Final = (DONE, ABORTED)

CLOSING_TICKS: Final = 4
"""Delay of the valve."""
ASTRAY_M: Final = 0.08
"""Distance from its line at which paint is wrong, beyond what the robot cannot know."""
ASTRAY_S: Final = 1.0
"""Time for which it may be, before anything is said."""
SIGMAS: Final = 4.0
SILENT_S: Final = 30.0
REST_MPS: Final = 0.05
BRAKING_M: Final = 0.3
"""Beyond v²/2a: delay of the command and lag of the motors at 1 m/s, and the rolling out."""
GAP_M: Final = 0.05
FAST: Final = 1.05
"""Times the speed limit: wheels that are larger than told, and slip downhill."""
FAULTS_OF_PAINT: Final = frozenset(("valve-stuck", "disc-stuck", "nozzle-clogged", "tank-empty"))
FAULTS_OF_POSITION: Final = frozenset(
    ("gnss-wrong-fix", "clock-skew", "gnss-degraded", "corrections-lost", "gnss-noisy")
)
FAULTS_OF_DRIVE: Final = frozenset(("wheel-slip", "wheel-blocked", "motor-weak", "encoder-dropout", "imu-bias"))


class Trouble(AssertionError):
    """A property does not hold."""

    def __init__(self, name: str, what: str) -> None:
        super().__init__(f"{name}: {what}")
        self.name = name


def unknowable_m(case: Case) -> float:
    """Displacement of paint or pose that no sensor of the robot shows, 3 σ where it is drawn."""
    truth = case.scenario.truth
    sizes = (
        truth.nozzle_y_m, truth.nozzle_x_m, truth.base_east_m, truth.base_north_m, truth.antenna_x_m, truth.antenna_y_m,
        truth.drift_east_m, truth.drift_north_m,
    )  # fmt: skip
    lean_m = 1.0 * (abs(truth.mast_left_rad) + abs(truth.mast_ahead_rad))
    late_m = VEHICLE.drive.transit_speed_mps * (abs(truth.stamp_offset_s) + 3.0 * truth.stamp_jitter_s)
    return math.fsum(map(abs, sizes)) + lean_m + late_m + 3.0 * sum(place.error_m for place in case.scenario.multipath)


class Property:
    """Base of the properties.

    Args:
        case: The case.
    """

    def __init__(self, case: Case) -> None:
        self.case = case
        self.kinds = {fault.kind for fault in case.scenario.faults}

    def look(self, now: Look) -> None:
        """See the robot after some ticks."""

    def end(self, driven: Driven) -> None:
        """See all of it."""

    def hold(self, well: bool, what: str, now: Look | None = None) -> None:
        """Raise `Trouble` unless all is well."""
        if not well:
            at = f"at {now.emulator.time_s:.2f} s " if now is not None else ""
            raise Trouble(type(self).__name__, at + what)


class SaidOrRight(Property):
    """Base: something may be wrong only for a short while, or once the robot has said so."""

    def __init__(self, case: Case) -> None:
        super().__init__(case)
        self._wrong_ticks, self._said = 0, False

    def wrong(self, now: Look) -> str:
        """Present violation; "" if there is none."""
        raise NotImplementedError

    def look(self, now: Look) -> None:
        own = (event for event in now.heard if event.severity >= Event.WARN and not event.code.startswith("fault-"))
        self._said = self._said or any(event.code != "about-to-move" for event in own)
        what = self.wrong(now)
        self._wrong_ticks = self._wrong_ticks + now.ticks if what else 0
        self.hold(self._said or self._wrong_ticks < 100 * ASTRAY_S, f"{what}, and nothing is said", now)


class PaintWhereItClaims(SaidOrRight):
    """No paint beside its line while the robot says that all is well."""

    def wrong(self, now: Look) -> str:
        emulator = now.emulator
        if emulator.onboard.state != RUNNING or not emulator.command.valve or "valve-stuck" in self.kinds:
            return ""
        lateral_m = abs(emulator.work.ledger.lateral_m)
        return f"paint {lateral_m:.3f} m beside its line" if lateral_m > ASTRAY_M + unknowable_m(self.case) else ""


class HonestSigma(SaidOrRight):
    """The estimate is wrong by at most 4 σ while the robot paints, or it says that its position is not consistent."""

    def wrong(self, now: Look) -> str:
        onboard, true = now.emulator.onboard, now.emulator.world.pose
        if onboard.state != RUNNING or not now.emulator.command.valve:
            return ""
        found = onboard.estimate
        error_m = math.hypot(found.east_m - true.east_m, found.north_m - true.north_m)
        sigma_m = math.sqrt(float(np.linalg.eigvalsh(np.reshape(found.covariance, (3, 3))[:2, :2])[1]))
        allowed_m = SIGMAS * sigma_m + unknowable_m(self.case)
        return f"estimate {error_m:.3f} m off with a σ of {sigma_m:.4f} m" if error_m > allowed_m else ""


class ValveShut(Property):
    """The valve is shut unless the robot runs."""

    def __init__(self, case: Case) -> None:
        super().__init__(case)
        self._ticks = 0

    def look(self, now: Look) -> None:
        emulator = now.emulator
        closed = now.ticks if self._ticks else 1  # the state has changed in the last tick of its look
        self._ticks = self._ticks + closed if emulator.onboard.state != RUNNING else 0
        self.hold(emulator.onboard.state == RUNNING or not emulator.command.valve, "valve commanded open", now)
        if "valve-stuck" not in self.kinds and self._ticks > CLOSING_TICKS:
            self.hold(not emulator.world.state.valve_open, "valve open", now)


class StaysStopped(Property):
    """After a stop the robot comes to rest within its braking distance, and stays there."""

    def __init__(self, case: Case) -> None:
        super().__init__(case)
        self._driven_m = self._allowed_m = 0.0

    def look(self, now: Look) -> None:
        emulator = now.emulator
        speed_mps = abs(emulator.world.state.speed_mps)
        if emulator.onboard.state == RUNNING or now.before == RUNNING or "kill" in now.given:
            self._driven_m = 0.0
            self._allowed_m = 0.5 * speed_mps**2 / VEHICLE.drive.max_acceleration_mps2 + BRAKING_M
            return
        self._driven_m += 0.01 * now.ticks * speed_mps
        if not self.kinds & FAULTS_OF_DRIVE:
            what = f"drove {self._driven_m:.2f} m after a stop, {self._allowed_m:.2f} m allowed"
            self.hold(self._driven_m <= self._allowed_m, what, now)


class NotTooFast(Property):
    """The robot is never faster than its drive allows."""

    def look(self, now: Look) -> None:
        speed_mps = abs(now.emulator.world.state.speed_mps)
        limit_mps = VEHICLE.drive.max_speed_mps
        self.hold(speed_mps <= FAST * limit_mps, f"{speed_mps:.2f} m/s, {limit_mps:.2f} allowed", now)


class LatchesEmergency(Property):
    """Only a reset releases an emergency stop."""

    def look(self, now: Look) -> None:
        left = now.before == ESTOPPED and now.emulator.onboard.state != ESTOPPED
        self.hold(not left, "left the emergency stop by itself", now)


class NeverSilent(Property):
    """A robot that stands says why, and one that does not move on is not silent for long."""

    def __init__(self, case: Case) -> None:
        super().__init__(case)
        self._arc_m, self._silent_ticks = -1.0, 0

    def look(self, now: Look) -> None:
        status = now.emulator.onboard.status
        if status.state in (PAUSED, ABORTED, ESTOPPED):
            self.hold(bool(status.reason), f"no reason in state {status.state}", now)
        stuck = status.state == RUNNING and status.arc_length_m == self._arc_m and not now.heard
        self._silent_ticks = self._silent_ticks + now.ticks if stuck else 0
        self._arc_m = status.arc_length_m
        self.hold(self._silent_ticks <= 100 * SILENT_S, f"silent for {SILENT_S:.0f} s: {status}", now)


class EndsOrSaysWhy(Property):
    """The job ends, or at the end of all patience the robot has a reason."""

    def end(self, driven: Driven) -> None:
        status = driven.emulator.onboard.status
        ended = status.state in ENDED or driven.emulator.onboard.state == TraversalStatus.IDLE
        self.hold(ended or bool(status.reason), f"{status} at {driven.emulator.time_s:.0f} s")
        if not self.kinds and not driven.orders and not driven.case.scenario.multipath:
            self.hold(driven.state == DONE, f"{status} without faults and orders")


class RefusesWithReason(Property):
    """A refused order has a reason."""

    def end(self, driven: Driven) -> None:
        for order, why in driven.refused:
            self.hold(bool(why), f"{order.name} refused without a reason")


class TrueReport(Property):
    """The reported share of the lines is that of a raster of the true paint, that of crossing lines included."""

    def end(self, driven: Driven) -> None:
        if driven.report.lateral_error_max_m > 0.04 or "nozzle-clogged" in self.kinds:
            return  # the raster takes paint at 5 cm, the report by the line's width
        lines = [segment.curve() for segment in driven.case.template.segments]
        painted_m = RASTER_M * sum(float(painted_cells(line, driven.strokes, along=0.0).sum()) for line in lines)
        reported_m = 0.01 * driven.report.coverage_pct * math.fsum(line.length_m for line in lines)
        off_m = abs(painted_m - reported_m)
        self.hold(off_m <= 0.04 * len(lines) + 0.01, f"{reported_m:.2f} m reported, {painted_m:.2f} m painted")


class TrueBelief(Property):
    """The robot believes no more painted than is."""

    def end(self, driven: Driven) -> None:
        if self.kinds & (FAULTS_OF_PAINT | FAULTS_OF_POSITION) or driven.report.lateral_error_max_m > 0.05:
            return
        length_m = math.fsum(segment.curve().length_m for segment in driven.case.template.segments)
        beyond_m = 0.01 * (driven.believed_pct - driven.report.coverage_pct) * length_m
        allowed_m = GAP_M * len(driven.case.template.segments) * (1 + len(driven.orders))
        self.hold(beyond_m <= allowed_m, f"believes {beyond_m:.2f} m painted that are not")


class NoGaps(Property):
    """A job that is done has no gap in its lines, whatever interrupted it."""

    def end(self, driven: Driven) -> None:
        if driven.state != DONE or self.kinds & (FAULTS_OF_PAINT | FAULTS_OF_POSITION):
            return
        if driven.report.lateral_error_max_m > 0.04:
            return
        allowed_m = GAP_M + 2.0 * unknowable_m(driven.case)
        for segment in driven.case.template.segments:
            gap_m = longest_m(~painted_cells(segment.curve(), driven.strokes))
            self.hold(gap_m <= allowed_m, f"a gap of {gap_m:.2f} m in {segment.id}")


PROPERTIES: Final = (
    PaintWhereItClaims, HonestSigma, ValveShut, StaysStopped, NotTooFast, LatchesEmergency, NeverSilent, EndsOrSaysWhy,
    RefusesWithReason, TrueReport, TrueBelief, NoGaps,
)  # fmt: skip
