"""Control of a replay over the bus, by each of its robots' services."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from touchline.bus import Bus
from touchline.bus.calls import ServedCall, Server
from touchline.recordings.replay.replay_player import ReplayPlayer
from touchline.schemas import topics
from touchline.schemas.messages import (
    ReplaySeekRequest,
    ReplaySetLoopsRequest,
    ReplayStepRequest,
    SetSpeedRequest,
)
from touchline.schemas.messages.base import Message
from touchline.schemas.topics import Service

FASTEST = 10_000.0
"""Highest speed factor; beyond is as fast as possible."""

_Handler = Callable[[ReplayPlayer, Any], str]


class ReplayControls:
    """Serves the services that control a replay; call `poll` in a loop."""

    def __init__(self, buses: Sequence[Bus], player: ReplayPlayer) -> None:
        """Declare the services on each of the buses."""
        self._player = player
        self._servers: list[tuple[Server[Any, Any], _Handler]] = [
            (bus.serve(service), handler) for bus in buses for service, handler in _HANDLERS.items()
        ]
        self._due: list[tuple[ServedCall[Any, Any], Any]] = []
        """Requests carried out whose messages have not all been sent."""

    def poll(self) -> None:
        """Take requests; each is answered once its messages have been sent."""
        if self._due and not self._player.jumping and not self._player.stepping:
            for done, kind in self._due:
                done.reply(kind(success=True, message=where(self._player)))
            self._due.clear()
        for server, handler in self._servers:
            while (call := server.poll()) is not None:
                response = server.service.response
                if problem := handler(self._player, call.request):
                    call.reply(response(success=False, message=problem))
                else:
                    self._due.append((call, response))


def where(player: ReplayPlayer) -> str:
    """Return the state of a replay as text."""
    doing = "playing" if player.playing else "paused"
    end = "" if math.isnan(player.end_s) else f" of {player.end_s:.1f} s"
    speed = "as fast as possible" if player.speed <= 0.0 else f"{player.speed:g}×"
    loops = "" if player.loops == 1 else f", pass {player.loop} of {player.loops or 'any number'}"
    return f"{doing} at {player.now_s:.1f} s{end}, {speed}{loops}"


def _pause(player: ReplayPlayer, _: Message) -> str:
    player.pause()
    return ""


def _resume(player: ReplayPlayer, _: Message) -> str:
    player.resume()
    return ""


def _seek(player: ReplayPlayer, request: ReplaySeekRequest) -> str:
    if not math.isfinite(request.time_s):
        return f"time_s is {request.time_s}; give a time in s of the recording"
    player.seek(request.time_s)
    return ""


def _step(player: ReplayPlayer, request: ReplayStepRequest) -> str:
    if not math.isfinite(request.seconds) or request.seconds < 0.0:
        return f"seconds is {request.seconds}; give how far to step in s, above 0"
    if bool(request.messages) == bool(request.seconds):
        return "give either messages or seconds above 0"
    player.step(request.messages, request.seconds)
    return ""


def _set_speed(player: ReplayPlayer, request: SetSpeedRequest) -> str:
    if math.isnan(request.factor) or request.factor == 0.0 or request.factor > FASTEST:
        return f"factor is {request.factor}; give one above 0 and up to {FASTEST:g}, or a negative one for no limit"
    player.set_speed(max(request.factor, -1.0))
    return ""


def _set_loops(player: ReplayPlayer, request: ReplaySetLoopsRequest) -> str:
    if 0 < request.loops < player.loop:
        return f"loops is {request.loops}, and it is in pass {player.loop}; give at least that, or 0 for no end"
    player.loops = request.loops
    return ""


_HANDLERS: dict[Service[Any, Any], _Handler] = {
    topics.REPLAY_PAUSE: _pause,
    topics.REPLAY_RESUME: _resume,
    topics.REPLAY_SEEK: _seek,
    topics.REPLAY_STEP: _step,
    topics.REPLAY_SET_SPEED: _set_speed,
    topics.REPLAY_SET_LOOPS: _set_loops,
}
