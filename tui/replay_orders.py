"""Orders to a replay: pause, resume, seek, step and speed."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from touchline.schemas import topics
from touchline.schemas.messages.base import Message
from touchline.schemas.messages.replay_messages import ReplaySeekRequest, ReplayStepRequest
from touchline.schemas.messages.service_messages import CommandRequest, SetSpeedRequest
from touchline.schemas.replay_steps import REPLAY_SPEEDS, STEP_S, next_speed
from touchline.schemas.topics import Service
from touchline.tui.orders import Order
from touchline.tui.state import ConsoleState

SEEK_TIMEOUT_S = 30.0
"""A recording without an index is read from its beginning."""


class ReplayOrders:
    """What is ordered of the replay of one robot."""

    def __init__(self, state: ConsoleState, send: Callable[[Order], bool], request_id: Callable[[], str]) -> None:
        """`send` does not wait, and says whether an order was sent: none is while one of its name is under way."""
        self._state, self._send, self._request_id = state, send, request_id
        self._seeking_s: float | None = None
        """Where the seek under way goes."""
        self._wanted_s: float | None = None
        """Where to go after it."""

    def toggle(self) -> None:
        """Pause, or go on."""
        service = topics.REPLAY_PAUSE if self._state.replay.playing else topics.REPLAY_RESUME
        title = "Pause the replay" if self._state.replay.playing else "Go on"
        self._order("replay", title, service, CommandRequest(request_id=self._request_id()))

    def resume(self) -> None:
        """Go on."""
        self._order("replay", "Go on", topics.REPLAY_RESUME, CommandRequest(request_id=self._request_id()))

    def step(self) -> None:
        """A tenth of a second further."""
        request = ReplayStepRequest(request_id=self._request_id(), seconds=STEP_S)
        self._order("replay-step", "Step", topics.REPLAY_STEP, request)

    def change_speed(self, steps: int) -> None:
        """Faster or slower."""
        status = self._state.replay.status
        if status is not None:
            factor = next_speed(REPLAY_SPEEDS, status.speed, steps)
            request = SetSpeedRequest(request_id=self._request_id(), factor=factor)
            self._order("replay-speed", "Speed", topics.REPLAY_SET_SPEED, request)

    def seek_by(self, seconds: float) -> None:
        """Back or on, from where the last seek goes if it is under way: no key press is lost."""
        status = self._state.replay.status
        if status is None:
            return
        known = (self._wanted_s, self._seeking_s, status.now_s)
        from_s = next(time_s for time_s in known if time_s is not None)
        end_s = math.inf if math.isnan(status.end_s) else status.end_s
        self._seek(min(max(from_s + seconds, status.begin_s), end_s))

    def answered(self, name: str) -> None:
        """An order has come back."""
        if name == "replay-seek":
            wanted_s, self._seeking_s, self._wanted_s = self._wanted_s, None, None
            if wanted_s is not None:
                self._seek(wanted_s)

    def _seek(self, time_s: float) -> None:
        request = ReplaySeekRequest(request_id=self._request_id(), time_s=time_s)
        if self._order("replay-seek", "Seek", topics.REPLAY_SEEK, request, SEEK_TIMEOUT_S):
            self._seeking_s = time_s
        else:
            self._wanted_s = time_s

    def _order(
        self, name: str, title: str, service: Service[Any, Any], request: Message, timeout_s: float = 3.0
    ) -> bool:
        return self._send(Order(name, title, service, request, timeout_s))
