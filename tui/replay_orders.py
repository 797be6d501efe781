"""Orders to a replay: pause, resume, seek, step and speed; keys that come faster than answers add up."""

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
"""A recording without an index is read from its beginning."""
_PLAY, _STEP, _SPEED, _SEEK = "replay", "replay-step", "replay-speed", "replay-seek"


class WantedValue:
    """A value of the replay that is being changed: what was asked for last, until the replay's status has it."""

    def __init__(self) -> None:
        """Nothing was asked for."""
        self._asked: float | None = None
        self._next: float | None = None
        """To be asked for when there is an answer."""
        self._reached: tuple[float, ReplayStatus | None] | None = None
        """What was answered, and the status then: that does not tell of it yet."""

    def latest(self, status: ReplayStatus, told: float) -> float:
        """The newest value; `told` is that of the status."""
        reached = self._reached[0] if self._reached is not None and self._reached[1] is status else None
        return next((value for value in (self._next, self._asked, reached) if value is not None), told)

    def ask(self, value: float, *, sent: bool) -> None:
        """It was asked for, or is to be when the order under way is answered."""
        if sent:
            self._asked = value
        else:
            self._next = value

    def answered(self, status: ReplayStatus | None, *, ok: bool) -> float | None:
        """The order under way was answered; returns what to ask for now."""
        reached, following = self._asked, self._next
        self._asked = self._next = None
        self._reached = (reached, status) if ok and reached is not None else None
        return following if ok else None


class ReplayOrders:
    """What is ordered of the replay of one robot."""

    def __init__(self, state: ConsoleState, send: Callable[[Order], bool], request_id: Callable[[], str]) -> None:
        """`send` does not wait, and says whether an order was sent: none is while one of its name is under way."""
        self._state, self._send, self._request_id = state, send, request_id
        self._playing, self._speed, self._time = WantedValue(), WantedValue(), WantedValue()
        self._steps_s = 0.0
        """To be made when the step under way is."""

    def toggle(self) -> None:
        """Pause, or go on."""
        status = self._state.replay.status
        playing = status is not None and self._playing.latest(status, float(status.playing)) > 0.0
        self._play(not playing)

    def resume(self) -> None:
        """Go on."""
        self._play(True)

    def step(self) -> None:
        """A tenth of a second further."""
        self._step(STEP_S)

    def change_speed(self, steps: int) -> None:
        """Faster or slower than what was asked for last."""
        status = self._state.replay.status
        if status is not None:
            self._set_speed(next_speed(REPLAY_SPEEDS, self._speed.latest(status, status.speed), steps))

    def seek_by(self, seconds: float) -> None:
        """Back or on, from where the last seek goes."""
        status = self._state.replay.status
        if status is None:
            return
        end_s = math.inf if math.isnan(status.end_s) else status.end_s
        self._seek(min(max(self._time.latest(status, status.now_s) + seconds, status.begin_s), end_s))

    def answered(self, name: str, *, ok: bool) -> None:
        """An order has come back: send what was wanted meanwhile."""
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
