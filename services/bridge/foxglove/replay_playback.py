"""Playback control of viewers, by which they play, pause and seek what is replayed on the bus."""

from __future__ import annotations

import time
import uuid
from collections.abc import Callable, Sequence
from typing import Any, Final

from foxglove.websocket import PlaybackCommand, PlaybackControlRequest, PlaybackState, PlaybackStatus

from touchline.bus import Bus, CallError
from touchline.schemas import topics
from touchline.schemas.errors import PayloadError
from touchline.schemas.messages import CommandRequest, ReplaySeekRequest, ReplayStatus, SetSpeedRequest
from touchline.schemas.messages.base import Message
from touchline.schemas.topics import Service
from touchline.services.bridge.foxglove.viewer_server import Span

_SEND_EVERY_S: Final = 0.1
_ANSWER_S: Final = 10.0
_NS: Final = 1_000_000_000
#: A paused replay nearer to the end than this (s) has ended.
_AT_END_S: Final = 1e-3


class ReplayPlayback:
    """State of replays for viewers, and their commands.

    Args:
        buses: Bus of each robot; a replay is reported under each of its own.
        asking: Bus of each robot by which viewers ask.
        check: Called while waiting for an answer; raises `CallError` if there is no time for that.
    """

    def __init__(self, buses: Sequence[Bus], asking: Sequence[Bus], check: Callable[[], None]) -> None:
        self._check = check
        self._ends = [
            (own, bus.presence(), bus.inbox([topics.REPLAY_STATUS], keep="latest"))
            for bus, own in zip(buses, asking, strict=True)
        ]
        self._bus = asking[0]
        self._status: ReplayStatus | None = None
        self._sent: ReplayStatus | None = None
        self._send_s = 0.0

    def turn(self) -> None:
        """Take the replay's status."""
        there = False
        for bus, presence, inbox in self._ends:
            presence.poll()
            if topics.REPLAY not in presence.alive():
                inbox.drain()
                continue
            there = True
            for _, message in inbox.messages():
                if isinstance(message, ReplayStatus):
                    self._bus, self._status = bus, message
        if not there:
            self._status = None

    @property
    def span_ns(self) -> Span | None:
        """Return the span that can be played; None while nothing is, or its length is unknown."""
        status = self._status
        if status is None or not status.end_s > status.begin_s:  # NaN: not known yet
            return None
        return _ns(status.begin_s), _ns(status.end_s)

    def news(self) -> PlaybackState | None:
        """Return the state of the replay, if it is due."""
        status, sent, now_s = self._status, self._sent, time.monotonic()
        if status is None or status == sent:
            return None
        jumped = sent is not None and sent.jumps != status.jumps
        changed = sent is None or jumped or sent.playing != status.playing or sent.speed != status.speed
        if not changed and now_s < self._send_s:
            return None
        self._sent, self._send_s = status, now_s + _SEND_EVERY_S
        return _state(status, jumped=jumped)

    def control(self, request: PlaybackControlRequest) -> PlaybackState | None:
        """Carry out a viewer's request; return the state after it, None if there is no replay.

        Called in a thread of the SDK.
        """
        status = self._status
        if status is None:
            return None
        changed: dict[str, object] = {}
        try:
            if request.seek_time is not None:
                time_s = request.seek_time / _NS
                if self._call(topics.REPLAY_SEEK, ReplaySeekRequest(request_id=_new(), time_s=time_s)):
                    changed["now_s"] = time_s
            if request.playback_speed > 0.0 and request.playback_speed != status.speed:
                speed = SetSpeedRequest(request_id=_new(), factor=request.playback_speed)
                if self._call(topics.REPLAY_SET_SPEED, speed):
                    changed["speed"] = request.playback_speed
            playing = request.playback_command == PlaybackCommand.Play
            if playing != status.playing:
                service = topics.REPLAY_RESUME if playing else topics.REPLAY_PAUSE
                if self._call(service, CommandRequest(request_id=_new())):
                    changed["playing"] = playing
        except (CallError, PayloadError):  # it has gone; the viewer gets the last known state
            pass
        return _state(status.model_copy(update=changed), jumped=request.seek_time is not None)

    def _call(self, service: Service[Any, Any], request: Message) -> bool:
        """Return whether the replay has done it."""
        return bool(self._bus.call(service, request, _ANSWER_S, self._check).success)


def _state(status: ReplayStatus, *, jumped: bool) -> PlaybackState:
    kind = PlaybackStatus.Playing if status.playing else PlaybackStatus.Paused
    if not status.playing and status.now_s > status.end_s - _AT_END_S:
        kind = PlaybackStatus.Ended
    return PlaybackState(kind, _ns(status.now_s), max(status.speed, 0.0), jumped, None)


def _ns(time_s: float) -> int:
    return max(round(time_s * _NS), 0)


def _new() -> str:
    return uuid.uuid4().hex
