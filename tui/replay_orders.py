"""Orders to a replay: pause, resume, seek, step and speed; keys faster than answers accumulate."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from touchline.schemas import topics
from touchline.schemas.messages.base import Message
from touchline.schemas.messages.replay_messages import ReplaySeekRequest, ReplayStatus, ReplayStepRequest
from touchline.schemas.messages.service_messages import CommandRequest, SetSpeedRequest
from touchline.schemas.replay_steps import REPLAY_SPEEDS, STEP_S, next_speed
from touchline.schemas.topics import Service
from touchline.tui.orders import Order
from touchline.tui.state import ConsoleState

SEEK_TIMEOUT_S = 30.0
"""Long enough for a recording without an index, which is read from its beginning."""
_PLAY, _STEP, _SPEED, _SEEK = "replay", "replay-step", "replay-speed", "replay-seek"


class WantedValue:
    """Requested value of the replay, until its status has it."""

    def __init__(self) -> None:
        """Create a value without a request."""
        self._asked: float | None = None
        self._next: float | None = None
        """Next request, after the answer."""
        self._reached: tuple[float, ReplayStatus | None] | None = None
        """Answered value, and the last status without it."""

    def latest(self, status: ReplayStatus, reported: float) -> float:
        """Newest value; `reported` is that of the status."""
        reached = self._reached[0] if self._reached is not None and self._reached[1] is status else None
        return next((value for value in (self._next, self._asked, reached) if value is not None), reported)

    def ask(self, value: float, *, sent: bool) -> None:
        """Note a request, which is `sent` or waits for the answer to the order under way."""
        if sent:
            self._asked = value
        else:
            self._next = value

    def answered(self, status: ReplayStatus | None, *, ok: bool) -> float | None:
        """Note the answer to the order under way; return the next request."""
        reached, following = self._asked, self._next
        self._asked = self._next = None
        self._reached = (reached, status) if ok and reached is not None else None
        return following if ok else None


class ReplayOrders:
    """Orders to the replay of one robot."""

    def __init__(self, state: ConsoleState, send: Callable[[Order], bool], request_id: Callable[[], str]) -> None:
        """Use `send`, which does not wait, and is false while an order of the same name is under way."""
        self._state, self._send, self._request_id = state, send, request_id
        self._playing, self._speed, self._time = WantedValue(), WantedValue(), WantedValue()
        self._steps_s = 0.0
        """Steps to make after the one under way."""

    def toggle(self) -> None:
        """Toggle between pause and play."""
        status = self._state.replay.status
        playing = status is not None and self._playing.latest(status, float(status.playing)) > 0.0
        self._play(not playing)

    def resume(self) -> None:
        """Resume the replay."""
        self._play(True)

    def step(self) -> None:
        """Advance by a tenth of a second."""
        self._step(STEP_S)

    def change_speed(self, steps: int) -> None:
        """Change the last requested speed by steps."""
        status = self._state.replay.status
        if status is not None:
            self._set_speed(next_speed(REPLAY_SPEEDS, self._speed.latest(status, status.speed), steps))

    def seek_by(self, seconds: float) -> None:
        """Seek by a time (s), relative to the last requested position."""
        status = self._state.replay.status
        if status is None:
            return
        end_s = math.inf if math.isnan(status.end_s) else status.end_s
        self._seek(min(max(self._time.latest(status, status.now_s) + seconds, status.begin_s), end_s))

    def answered(self, name: str, *, ok: bool) -> None:
        """Process an outcome, and send what was requested meanwhile."""
        status = self._state.replay.status
        if name == _SEEK and (time_s := self._time.answered(status, ok=ok)) is not None:
            self._seek(time_s)
        elif name == _SPEED and (speed := self._speed.answered(status, ok=ok)) is not None:
            self._set_speed(speed)
        elif name == _PLAY and (playing := self._playing.answered(status, ok=ok)) is not None:
            self._play(playing > 0.0)
        elif name == _STEP:
            due_s, self._steps_s = self._steps_s, 0.0
            if ok and due_s:
                self._step(due_s)

    def _play(self, playing: bool) -> None:
        title, service = ("Go on", topics.REPLAY_RESUME) if playing else ("Pause the replay", topics.REPLAY_PAUSE)
        self._playing.ask(float(playing), sent=self._order(_PLAY, title, service, CommandRequest()))

    def _step(self, seconds: float) -> None:
        if not self._order(_STEP, "Step", topics.REPLAY_STEP, ReplayStepRequest(seconds=seconds)):
            self._steps_s += seconds

    def _set_speed(self, factor: float) -> None:
        sent = self._order(_SPEED, "Speed", topics.REPLAY_SET_SPEED, SetSpeedRequest(factor=factor))
        self._speed.ask(factor, sent=sent)

    def _seek(self, time_s: float) -> None:
        request = ReplaySeekRequest(time_s=time_s)
        self._time.ask(time_s, sent=self._order(_SEEK, "Seek", topics.REPLAY_SEEK, request, SEEK_TIMEOUT_S))

    def _order(
        self, name: str, title: str, service: Service[Any, Any], request: Message, timeout_s: float = 3.0
    ) -> bool:
        named = request.model_copy(update={"request_id": self._request_id()})
        return self._send(Order(name, title, service, named, timeout_s))
