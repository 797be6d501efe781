"""Link to one robot of a team: its messages, and the guidance for it."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import Final

from touchline.bus import Bus
from touchline.coordination.coordination import Reported
from touchline.coordination.guidance_messages import stamped_guidance
from touchline.coordination.reported_contacts import tick_of
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.team import TeamScenario

_CHARGE_TICKS: Final = 100
"""Ticks from one message about the battery to the next."""
_CALL_S: Final = 0.5
"""Wall-clock time from one call to a silent robot to the next."""


class RobotLink:
    """Messages from and to one robot.

    Attributes:
        whereabouts: Its last message.
        heard_at_s: Time of that, wall clock (monotonic).
        fresh: Whether it has sent a message since the last look.
        path: Its true path up to the last exchange in lockstep.
        charge: Charge of its battery, a share of the whole; nan: unknown.
    """

    def __init__(self, bus: Bus, team: TeamScenario, *, lockstep: bool) -> None:
        """Subscribe on the robot's own bus; in lockstep also to the truth."""
        reported = topics.PLAN_STATE if team.by_plans else topics.WHEREABOUTS
        self._told_charge = team.task.kind == "dispatch" or not lockstep
        heard = [reported, *((topics.TRUE_WAY,) if lockstep else ()), *((topics.BATTERY,) if self._told_charge else ())]
        self._inbox = bus.inbox(heard, keep="recent")
        self._lockstep = lockstep
        self.charge, self._charge_tick = math.nan, -1
        self.path: m.TrueWay | None = None
        self._guidance = bus.publisher(topics.GUIDANCE, bus.publisher_id)
        self.whereabouts: Reported | None = None
        self.heard_at_s, self.fresh, self._call_at_s = time.monotonic(), False, 0.0
        self._after_s = -math.inf

    @property
    def tick(self) -> int:
        """Tick of its last message; −1 before."""
        return round(100 * self.whereabouts.stamp_s) if self.whereabouts is not None else -1

    def has_reported(self, tick: int) -> bool:
        """Return whether it has reported its place at a tick and, in lockstep, its path to it and its charge."""
        if not self._lockstep:
            return self.tick >= tick
        charged = not self._told_charge or self._charge_tick >= tick // _CHARGE_TICKS * _CHARGE_TICKS
        return self.tick >= tick and charged and self.path is not None and tick_of(self.path) >= tick

    def begin(self) -> None:
        """Forget where the robot was, by whatever clock."""
        self.whereabouts, self._after_s = None, -math.inf

    def forget_until(self, stamp_s: float) -> None:
        """Forget what the robot has reported up to a time by its clock, also if it comes later."""
        self._after_s = stamp_s
        if self.whereabouts is not None and self.whereabouts.stamp_s <= stamp_s:
            self.whereabouts = None

    def listen(self, now_s: float) -> None:
        """Take messages that have arrived since the last call."""
        for _, message in self._inbox.messages():
            if isinstance(message, m.Whereabouts | m.PlanState):
                if message.stamp_s <= self._after_s:
                    continue
                self.whereabouts, self.heard_at_s, self.fresh = message, now_s, True
            elif isinstance(message, m.TrueWay):
                self.path = message
            elif isinstance(message, m.BatteryState):
                self.charge, self._charge_tick = message.percentage, tick_of(message)

    def call(self, tick: int, now_s: float) -> None:
        """Let a silent robot go on to a tick, now and then: what it waits for, or what it has reported, may be lost."""
        if now_s >= self._call_at_s:
            self._call_at_s = now_s + _CALL_S
            self.send((), tick)

    def send(self, guidance: Sequence[m.Guidance], tick: int) -> None:
        """Send guidance, at least an acknowledgement; `tick` is that of its whereabouts."""
        for message in stamped_guidance(guidance, tick):
            self._guidance.send(message)
