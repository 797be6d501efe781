"""Replay of a recording on the bus."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from touchline.bus import Bus, BusConfig
from touchline.recordings.recording_file import RecordingError
from touchline.recordings.replay.replay_player import ReplayPlayer
from touchline.recordings.replay.replay_source import ReplaySource
from touchline.recordings.replay.replayer import recorded_robots
from touchline.schemas import topics
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import ReplayStatus
from touchline.schemas.replay_run import ReplayRun
from touchline.services.bridge.handshake import shake_hands
from touchline.services.bridge.replay_controls import ReplayControls, where
from touchline.services.bridge.replayed_robot import ReplayedRobot

_SETTLE_S: Final = 0.5
_HANDSHAKE_TIMEOUT_S: Final = 5.0
_LOOK_EVERY_S: Final = 0.1
"""Period of the status, and of looks for robots that have come."""
_TURN_S: Final = 0.02
"""Longest time for sending before requests are looked at."""
_IDLE_S: Final = 0.01


@dataclass(frozen=True)
class ReplayReport:
    """Result of a replay.

    Attributes:
        sent: Messages put on the bus.
        skipped: Messages of topics that are not in the topic table.
        sim_time_s: Sim time replayed.
        problem: What could not be read of the recording; empty if it is complete.
        reasons: Why messages of topics in the table were skipped.
    """

    sent: int
    skipped: int
    sim_time_s: float
    problem: str
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True)
class Playback:
    """Options of a replay.

    Attributes:
        speed: Sim time per wall time; 0 or less: as fast as possible.
        robots: Of a recording of several, those that are replayed; empty: all.
        loops: Number of passes; 0: endless.
        from_s, to_s: Beginning and end, s on the recording's own clock.
        paused: Whether to start paused.
        stay: Whether to stay at the end, paused.
    """

    speed: float = 1.0
    robots: Sequence[str] = ()
    loops: int = 1
    from_s: float = -math.inf
    to_s: float = math.inf
    paused: bool = False
    stay: bool = False


_ONCE = Playback()


def run_replay(
    path: Path,
    playback: Playback = _ONCE,
    config: BusConfig | None = None,
    *,
    progress: Callable[[float, float], None] | None = None,
    attend: Callable[[ReplayPlayer], None] = lambda _: None,
    stop: Callable[[], bool] = lambda: False,
) -> ReplayReport:
    """Replay a recording on the bus: a single robot as the bus's robot, several each under its own namespace.

    Args:
        path: MCAP file, complete or cut off.
        playback: Options.
        config: Bus configuration, with the name for a single robot; from the environment if not given.
        progress: Called now and then with (fraction of the recording, its time in s).
        attend: Called now and then with the replay, to control it.
        stop: Asked before every message whether to end now.

    Raises:
        RecordingError: The file cannot be opened or is not MCAP, lacks a named robot, or has nothing between the given
            times.
        CommandRefused: A robot is on the bus under such a namespace, or has come, whose messages would mix with the
            recorded ones.
        TouchlineError: Another replay is.
    """
    config = config or BusConfig.from_environment()
    names = _names(path, config, playback.robots)  # a missing file is refused before the bus is opened
    source = ReplaySource(path)
    _check_times(path, source, playback)
    player = ReplayPlayer(source, playback.speed, not playback.paused, playback.loops, playback.from_s, playback.to_s)
    with Bus.open_all(topics.REPLAY, config.of(*names.values())) as buses:
        run = ReplayRun(os.urandom(6))
        robots = {recorded: ReplayedRobot(bus, run) for recorded, bus in zip(names, buses, strict=True)}
        time.sleep(_SETTLE_S)  # newcomers learn of the publishers, and we of them
        for bus in buses:
            bus.claim()
        session = _Replay(path, player, robots, run, progress)
        session.check_alone()
        _meet_the_bridge(buses)
        controls = ReplayControls(buses, player)
        while not stop() and not (player.ended and not playback.stay):
            attend(player)
            controls.poll()
            session.turn(stop)
        controls.poll()  # what ended it is answered, too
        _meet_the_bridge(buses)
        return session.report()


def _names(path: Path, config: BusConfig, robots: Sequence[str]) -> dict[str, str]:
    """Return the namespace on the bus of each robot that is replayed, by that in the recording."""
    recorded = recorded_robots(path)
    if len(recorded) <= 1:
        return {"".join(recorded): config.namespace}
    for robot in robots:
        if robot not in recorded:
            raise RecordingError(f"{path}: has no robot {robot}, but {', '.join(recorded)}")
    return {robot: robot for robot in robots or recorded}


def _check_times(path: Path, source: ReplaySource, playback: Playback) -> None:
    """Refuse a stretch without messages."""
    end_s = source.begin_s + source.length_s
    if playback.from_s > end_s or playback.to_s < source.begin_s or playback.to_s < playback.from_s:
        asked = f"nothing from {playback.from_s:g} s to {playback.to_s:g} s"
        raise RecordingError(f"{path}: has {asked}; it goes from {source.begin_s:.3f} s to {end_s:.3f} s")


def _meet_the_bridge(buses: Sequence[Bus]) -> None:
    """Wait until a bridge, if there is one, listens and has all that we have sent: it may be recording."""
    for bus in buses:
        presence = bus.presence()
        shake_hands(bus, presence, {topics.BRIDGE}, _HANDSHAKE_TIMEOUT_S)


class _Replay:
    """Replay in progress: messages, status and pace."""

    def __init__(
        self,
        path: Path,
        player: ReplayPlayer,
        robots: Mapping[str, ReplayedRobot],
        run: ReplayRun,
        progress: Callable[[float, float], None] | None,
    ) -> None:
        self._path, self._player, self._robots, self._progress = path, player, robots, progress
        self._run = run
        self._recalling = player.jumping
        self._sent = 0
        self._published: ReplayStatus | None = None
        self._publish_due_s = 0.0
        self._pace = _Pace()

    def check_alone(self) -> None:
        """Refuse to replay a robot that is on the bus.

        Raises:
            CommandRefused: One is.
        """
        for robot in self._robots.values():
            if robot.robot_is_there():
                which = f"a robot is on the bus as {robot.bus.namespace}"
                raise CommandRefused(f"{which}; stop it before replaying, or use another namespace")

    def turn(self, stop: Callable[[], bool]) -> None:
        """Send what is due, answer requests, publish the status; then rest until more is due."""
        begun_s = now_s = time.monotonic()
        while now_s < begun_s + _TURN_S and self._send(now_s) and not stop():
            now_s = time.monotonic()
        self._publish_status(now_s)
        factor = self._player.speed if self._player.speed > 0.0 else -1.0
        figures = {"speed_factor": factor, "real_time_factor": f"{self._pace.factor:.3g}", "recording": ""}
        for robot in self._robots.values():
            robot.serve(figures, where(self._player))
        if not self._player.ended:
            time.sleep(self._player.wait_s(time.monotonic(), _IDLE_S))

    def _send(self, now_s: float) -> bool:
        """Send the next message if it is due."""
        player = self._player
        cue = player.take(now_s)
        if self._run.jumps != player.jumps:
            self._run = ReplayRun(self._run.key, player.jumps)
            for each in self._robots.values():
                each.begin_anew(self._run)
            self._recalling = player.jumping or cue is not None
        if cue is not None and (robot := self._robots.get(cue.namespace)) is not None:
            (robot.recall if self._recalling else robot.send)(cue)
            self._sent += 1
        if self._recalling and not player.jumping:
            self._recalling = False
            for each in self._robots.values():
                each.recall_paint()
        return cue is not None

    def _publish_status(self, now_s: float) -> None:
        status = self._status()
        changed = (
            self._published is None or status.model_copy(update={"now_s": self._published.now_s}) != self._published
        )
        if not changed and now_s < self._publish_due_s:
            return
        self._publish_due_s = now_s + _LOOK_EVERY_S
        self._pace.note(now_s, self._player.now_s, self._player.jumps)
        self.check_alone()
        if status != self._published:
            self._published = status
            for robot in self._robots.values():
                robot.publish_status(status)
        if self._progress is not None:
            self._progress(self._fraction(), self._player.now_s)

    def _fraction(self) -> float:
        player = self._player
        length_s = player.end_s - player.begin_s
        if math.isnan(length_s):
            return player.source.fraction
        return (player.now_s - player.begin_s) / length_s if length_s > 0.0 else 1.0

    def _status(self) -> ReplayStatus:
        player = self._player
        return ReplayStatus(
            file=self._path.name,
            robots=tuple(robot.bus.namespace for robot in self._robots.values()),
            begin_s=player.begin_s,
            end_s=player.end_s,
            now_s=player.now_s,
            begin_wall_s=player.source.begin_wall_s(player.begin_s),
            speed=player.speed if player.speed > 0.0 else -1.0,
            playing=player.playing,
            jumps=player.jumps,
            loop=player.loop,
            loops=player.loops,
        )

    def report(self) -> ReplayReport:
        """Return the result so far."""
        source = self._player.source
        source.close()
        return ReplayReport(self._sent, source.skipped, self._player.played_s, source.problem, tuple(source.reasons))


class _Pace:
    """Measured pace of recorded time."""

    def __init__(self) -> None:
        self.factor = 0.0
        self._last: tuple[float, float, int] | None = None

    def note(self, wall_s: float, time_s: float, jumps: int) -> None:
        """Note the replay's time; after a jump the measurement starts over."""
        if self._last is not None and self._last[2] == jumps and wall_s > self._last[0]:
            self.factor = (time_s - self._last[1]) / (wall_s - self._last[0])
        self._last = wall_s, time_s, jumps
