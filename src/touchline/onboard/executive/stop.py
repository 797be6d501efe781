"""Stop: the pause of a robot, how it ends by itself, and the warning before the robot moves off."""

from __future__ import annotations

import math
from typing import NamedTuple

from touchline.onboard.computer_state import ComputerState
from touchline.onboard.executive.events import WARN, EventLog
from touchline.onboard.executive.localization_monitor import LocalizationMonitor
from touchline.onboard.executive.move_off import MoveOffRules
from touchline.onboard.executive.retry_limit import MAX_TRIES, Tries
from touchline.onboard.executive.traversal_job import TraversalJob
from touchline.onboard.interface import TICKS_PER_S, MoveOffWarning, Pause
from touchline.onboard.protection.protector import Protector
from touchline.schemas.messages import PauseStatus

MAX_RESUME_DISTANCE_M = 0.5
ABOUT_TO_MOVE = "about to move; keep clear"


class Attempt(NamedTuple):
    """Result of a tick in which a pause may end by itself."""

    reason: str
    """Reason why the robot still stands."""
    person: str = ""
    """Reason why it waits for a person from now on; "" if it does not."""
    goes_on: bool = False


class TraversalStop:
    """Present stop of a robot, or the last one.

    Attributes:
        pause: The pause; None if the robot does not pause.
        why: Reason of the last pause, whatever has become of it.
        lasts: True if the hazard that caused it can be seen at standstill, too.
        since_tick: Start of the standstill, if the robot pauses, or has not set off since.
        warning: Given from before the robot moves off until it is stopped; None while it is to stand.
        tries: Successive tries to continue by itself.
    """

    def __init__(
        self,
        rules: MoveOffRules,
        computer: ComputerState,
        watch: LocalizationMonitor,
        protection: Protector,
        log: EventLog,
    ) -> None:
        self._rules, self._clock, self._watch, self._log = rules, computer.clock, watch, log
        self._protection = protection
        self.pause: Pause | None = None
        self.why = ""
        self.lasts = False
        self.since_tick = 0
        self.warning: MoveOffWarning | None = None
        self.tries = Tries()
        self._lost_tick: int | None = None

    def clear(self) -> None:
        """Forget the pause and the warning."""
        self.pause = self.warning = None

    def begin(self, by: Pause, reason: str) -> None:
        """Begin a pause."""
        self.pause, self.why, self.lasts, self._lost_tick = by, reason, False, None

    def warn_of_start(self, reason: str) -> None:
        """Begin to warn before the robot moves off at a start."""
        self._warn(reason, self._rules.start_warning_ticks)

    def warn_again(self, warning: MoveOffWarning | None, reason: str, *, standing: bool) -> None:
        """Continue a warning after the pause, or begin a new one unless the robot still moves."""
        if warning is not None or not standing:
            self.warning = warning or MoveOffWarning(self._clock.tick, reason)
        else:
            self._warn(reason, self._rules.warning_ticks)

    def _warn(self, reason: str, ticks: int) -> None:
        """Begin to warn; the robot does not move off in so many ticks."""
        self.warning = MoveOffWarning(self._clock.tick + ticks, reason)

    def warns_in(self, tick: int) -> bool:
        """Return True if the robot has to stand in this tick because it warns."""
        return self.warning is not None and tick < self.warning.earliest_tick

    @property
    def ends_by_itself(self) -> bool:
        """True if the robot pauses and will move off without a person."""
        return self.pause is not None and self.pause.ends_by_itself

    @property
    def pause_now(self) -> Pause | None:
        """The pause, with the earliest end of one that ends by itself as it is known now."""
        if self.pause is None or not self.pause.ends_by_itself:
            return self.pause
        if self.warning is not None:
            return self.pause._replace(earliest_tick=self.warning.earliest_tick)
        settled_tick = math.ceil(max(self._clock.tick, TICKS_PER_S * self._watch.findings.settled_at_s))
        return self.pause._replace(earliest_tick=settled_tick + self._rules.warning_ticks)

    def too_long(self, until_tick: int) -> bool:
        """Return True if the stop, up to this tick, is too long to end by itself, or the pose has been bad for so long.

        A wait for something in the way may last for ever, but not with a pose that does not let the robot drive.
        """
        lost = self._lost_tick is not None and self._too_long(until_tick - self._lost_tick, waits=False)
        return lost or self._too_long(until_tick - self.since_tick, waits=self._waits)

    def _too_long(self, ticks: int, *, waits: bool) -> bool:
        return ticks > self._rules.longest_s(waits=waits) * TICKS_PER_S

    @property
    def longest(self) -> str:
        """Longest stop that ends by itself, in words."""
        return f"{self._rules.longest_s(waits=self._waits and self._lost_tick is None):g} s"

    @property
    def _waits(self) -> bool:
        """True if the robot pauses because of something in the way."""
        return self.pause is not None and self.pause.cause == PauseStatus.IN_THE_WAY

    def attempt(self, job: TraversalJob) -> Attempt:
        """Warn, then end the pause, once pose and way have been good for a while and the robot stands."""
        tick = self._clock.tick
        in_the_way = self._protection.against_going_on(job)
        settled = job.standing and self._watch.settled(tick / TICKS_PER_S) and not in_the_way
        if not settled:
            self.warning = None
        lost = self._watch.drive_problem() or self._watch.pose_problem
        if not lost:
            self._lost_tick = None
        elif self._lost_tick is None:
            self._lost_tick = tick
        reason = lost or in_the_way or (self.why if self.warning is None else ABOUT_TO_MOVE)
        earliest_tick = tick + self._rules.warning_ticks if self.warning is None else self.warning.earliest_tick
        if self.too_long(earliest_tick):
            return Attempt(reason, f"stopped for more than {self.longest}: {reason}")
        if settled and (self.warning is None or tick >= self.warning.earliest_tick):
            return self._end(job, reason)
        return Attempt(reason)

    def _end(self, job: TraversalJob, reason: str) -> Attempt:
        """Warn that the pause is about to end, or, after that, end it."""
        distance = 0.0 if job.aligning else job.locate()
        if distance > MAX_RESUME_DISTANCE_M:
            return Attempt(reason, f"the robot stands {distance:.2f} m beside its path")
        if self.warning is not None:
            return Attempt(reason, goes_on=True)
        # Passers-by come again and again; that says nothing about the place.
        if not self._waits and not self.tries.another(job.next_paint_m):
            return Attempt(reason, f"gave up after {MAX_TRIES} tries: {self.why}")
        self._warn("goes on by itself", self._rules.warning_ticks)
        seconds = f"{self._rules.warning_ticks / TICKS_PER_S:g} s"
        self._log.report(WARN, "about-to-move", f"about to move: the robot goes on by itself in {seconds}")
        return Attempt(reason)
