"""Link of a guided robot to its team's coordinator over the bus; in lockstep, sim time is held until it answers.

The robot obeys the coordinator that it has joined, and no other session; guidance from others is reported. In lockstep
it also publishes its true path since the last exchange: no robot knows where the others are, so contacts, which press
the bumper, are detected by the process that receives the paths of all.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.bus import Bus
from touchline.bus.attachment import session_publisher
from touchline.onboard.executive.owner_fence import OwnerFence
from touchline.onboard.interface import OnboardEvent
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.messages import Event, Guidance, PlanState, SetOwnerRequest, SetOwnerResponse, TrueWay
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.packing import Payload, header
from touchline.services.robot_sim.tick_log import TRUTH, Rows

PATIENCE_S: Final = 10.0
"""Wall-clock time after which a coordinator that does not answer is no longer waited for, until it answers again."""
_NEVER: Final = 1 << 30
_LOOK_S: Final = 0.2
"""Wall time between two checks that the coordinator is still on the bus."""
_STRANGERS: Final = 8
"""Number of strangers that are reported while a robot is guided."""


class GuidedLink:
    """Link of one guided robot.

    Args:
        bus: Bus of the robot.
        emulator: The robot.
    """

    def __init__(self, bus: Bus, emulator: Emulator) -> None:
        self._bus, self._inbox = bus, bus.inbox([topics.GUIDANCE])
        self._fence, self._publisher = OwnerFence(), b""
        self._strangers: set[bytes] = set()
        self._news: list[OnboardEvent] = []
        self._there, self._look_at_s = True, 0.0
        self._lost = False
        self._emulator = emulator
        self._step = 0
        self._answered_tick = -1
        self._held_since_s = math.inf
        self._waits = True
        self._true_path: list[NDArray[np.float64]] = []

    def begin(self, coordinator: str, lockstep_s: float) -> None:
        """Begin guided driving.

        Args:
            coordinator: Id of the coordinator's session.
            lockstep_s: Interval at which the robot waits for an answer; 0: never.
        """
        self._fence.take(coordinator, self._fence.epoch + 1)
        self._obey(coordinator)
        self._true_path = []
        self._step = round(100 * lockstep_s)
        self._answered_tick, self._waits, self._held_since_s = self._emulator.tick_count, True, math.inf

    def _obey(self, coordinator: str) -> None:
        """Take guidance of this session alone from now on."""
        self._publisher = session_publisher(coordinator)
        self._strangers, self._news, self._there, self._look_at_s = set(), [], True, 0.0
        self._lost = False
        self._inbox.drain()

    def set_owner(self, request: SetOwnerRequest) -> SetOwnerResponse:
        """Obey a coordinator that takes over, if its epoch is newer; say who guides the robot, and which plan.

        A robot in a cell forgets it, brakes, and reports that.
        """
        problem, onboard = self._owner_problem(request), self._emulator.onboard
        if not problem:
            former = self._fence.owner
            if onboard.plan_state is None and request.epoch > self._fence.epoch:
                self._emulator.forget_cell()
            self._fence.take(request.coordinator, request.epoch)
            if former != request.coordinator:
                self._obey(request.coordinator)
                text = f"session {request.coordinator} guides the robot from now on, in epoch {request.epoch}"
                self._news.append(OnboardEvent(Event.WARN, "coordinator-replaced", f"{text}, instead of {former}"))
            self._waits, self._held_since_s = True, math.inf
        plan, start_s = onboard.followed_plan
        return SetOwnerResponse(
            success=not problem,
            message=problem or f"guided in epoch {request.epoch}",
            coordinator=self._fence.owner if self.under_way else "",
            epoch=self._fence.epoch,
            state=onboard.plan_state or PlanState(stamp_s=self._emulator.time_s, aligned=False),
            plan=plan.ravel(),
            plan_start_s=start_s,
        )

    def _owner_problem(self, request: SetOwnerRequest) -> str:
        """Return why a coordinator cannot take over; "" if it can."""
        if not self.under_way:
            return "the robot is not guided: nobody can take it over"
        if request.epoch < self._fence.epoch or (
            request.epoch == self._fence.epoch and request.coordinator != self._fence.owner
        ):
            guided = f"session {self._fence.owner} guides the robot in epoch {self._fence.epoch}"
            return f"{guided}: session {request.coordinator} of epoch {request.epoch} is refused"
        if not self.knows(request.coordinator):
            return f'the session "{request.coordinator}" is not on the bus as a coordinator'
        return ""

    def turn(self, now_s: float) -> list[OnboardEvent]:
        """Receive the coordinator's messages; return events for the operator. `now_s` is monotonic wall time."""
        self._take()
        if self.under_way:
            self._look_for_coordinator(now_s)
        news, self._news = self._news, []
        return news

    def _take(self) -> None:
        """Receive guidance of the coordinator, and note other senders."""
        for sample, message in self._inbox.messages():
            if sample.publisher != self._publisher:
                self._ignore(sample.publisher)
            elif isinstance(message, Guidance):
                self._emulator.take_guidance(message)
                stamp = message.header.stamp
                self._note_answer(100 * stamp.sec + stamp.nanosec // 10_000_000)

    def _note_answer(self, tick: int) -> None:
        """Note up to which tick the coordinator has answered; one that goes on is waited for again."""
        if tick > self._answered_tick:
            self._answered_tick, self._waits, self._held_since_s = tick, True, math.inf

    def _ignore(self, publisher: bytes) -> None:
        """Report a sender of ignored guidance, once."""
        if not self.under_way or publisher in self._strangers or len(self._strangers) == _STRANGERS:
            return
        self._strangers.add(publisher)
        who = publisher.hex() or "unknown"
        text = f"guidance of publisher {who} is ignored: the robot is guided by session {self._fence.owner}"
        self._news.append(OnboardEvent(Event.WARN, "stranger", text))

    def _look_for_coordinator(self, now_s: float) -> None:
        """Report once that the coordinator has left; its last guidance ends with its lease, then the robot brakes."""
        if now_s < self._look_at_s:
            return
        self._look_at_s = now_s + _LOOK_S
        was_there, self._there = self._there, self.knows(self._fence.owner)
        if was_there and not self._there and not self._lost:
            self._lost = True
            text = "the coordinator has left the bus: the robot stops and waits; abort, and have it guided anew"
            self._news.append(OnboardEvent(Event.ERROR, "coordinator-lost", text))

    def knows(self, session: str) -> bool:
        """Return True if a session is on the bus as a coordinator, by its liveliness token; in any thread."""
        return session in self._bus.sessions(topics.COORDINATOR)

    @property
    def under_way(self) -> bool:
        """True while the robot is guided and publishes its place."""
        return self._emulator.onboard.guided

    @property
    def in_step(self) -> bool:
        """True if sim time waits for the coordinator, and so does not follow the wall clock."""
        return self._step > 0 and self.under_way

    def ticks_ahead(self) -> int:
        """Return the number of ticks that may pass before the next answer is needed."""
        if not self.in_step:
            return _NEVER
        return self._step - self._emulator.tick_count % self._step

    def drove(self, rows: Rows) -> list[Payload]:
        """Return messages about ticks, rows (n, tick_log.columns): at an exchange, the true path since the last."""
        if not self.in_step:
            return []
        self._true_path.append(rows[:, TRUTH : TRUTH + 2].copy())
        tick = self._emulator.tick_count
        if tick % self._step:
            return []
        x_m, y_m = np.ascontiguousarray(np.concatenate(self._true_path).T)
        self._true_path = []
        return [(topics.TRUE_WAY, encode(TrueWay(header=header(tick), x_m=x_m, y_m=y_m)))]

    def held(self, now_s: float, *, hurries: bool = True) -> bool:
        """Return True if sim time has to wait for an answer.

        Args:
            now_s: Monotonic wall time.
            hurries: Whether it passes as fast as possible; else it does not wait for a coordinator that has left.
        """
        tick = self._emulator.tick_count
        at_gate = self._step and tick % self._step == 0 and self._answered_tick < tick
        if not at_gate or not self.under_way or (not hurries and not self._there):
            self._held_since_s = math.inf
            return False
        self._take()
        if self._answered_tick >= tick:
            return False
        self._held_since_s = min(self._held_since_s, now_s)
        if now_s - self._held_since_s > PATIENCE_S:
            self._waits = False
        return self._waits
