"""Replaying a recording onto the bus."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from touchline.schemas import topics
from touchline.schemas.errors import CommandRefused
from touchline.services.bridge.handshake import shake_hands
from touchline.services.bridge.output import RecordingError
from touchline.services.bridge.replayer import Timeline, recorded_robots
from touchline.services.bus import Bus, BusConfig, Publisher
from touchline.services.bus.presence import Presence

_SETTLE_S = 0.5
_HANDSHAKE_TIMEOUT_S = 5.0
_PROGRESS_PERIOD_S = 0.1


@dataclass(frozen=True)
class ReplayReport:
    """What was replayed.

    Attributes:
        sent: Messages put on the bus.
        skipped: Messages of topics that are not in the topic table.
        sim_time_s: Sim time replayed.
        problem: What could not be read of the recording; empty if it is whole.
        reasons: Why messages of topics in the table were skipped all the same.
    """

    sent: int
    skipped: int
    sim_time_s: float
    problem: str
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True)
class Playback:
    """What is replayed of a recording, and how.

    Attributes:
        speed: Sim time per wall time; 0 or less is as fast as it goes.
        robots: Of a recording of several, those that are replayed; all if empty.
        loops: How many times to replay it; 0 without end.
    """

    speed: float = 1.0
    robots: Sequence[str] = ()
    loops: int = 1


_ONCE = Playback()


def run_replay(
    path: Path,
    playback: Playback = _ONCE,
    config: BusConfig | None = None,
    *,
    progress: Callable[[float, float], None] | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> ReplayReport:
    """Put a recording onto the bus: that of one robot as the bus's robot, that of several each under its own namespace.

    Args:
        path: MCAP file, whole or broken off.
        playback: What of it, how fast and how often.
        config: Where the bus is, and as which robot that of a recording of one appears; from the environment if not
            given.
        progress: Called now and then with (fraction of the file, sim time s).
        stop: Asked before every message whether to end now.

    Raises:
        RecordingError: The file cannot be opened or is not MCAP, or has not one of the robots that are named.
        CommandRefused: A robot is on the bus under such a namespace, whose messages would mix with the recorded ones.
    """
    config = config or BusConfig.from_environment()
    names = _names(path, config, playback.robots)  # a missing file is refused before the bus is opened
    with Bus.open_all(topics.REPLAY, config.of(*names.values()), stop) as buses:
        presences = [bus.presence() for bus in buses]
        publishers = {
            (recorded, topic.name): bus.publisher(topic)
            for recorded, bus in zip(names, buses, strict=True)
            for topic in topics.TOPICS
        }
        time.sleep(_SETTLE_S)  # who is there learns of the publishers, and we of them
        for bus, presence in zip(buses, presences, strict=True):
            presence.poll()
            if topics.ROBOT_SIM in presence.alive():
                which = f"a robot is on the bus as {bus.namespace}"
                raise CommandRefused(f"{which}; stop it before replaying, or use another namespace")
        _meet_the_bridge(buses, presences)
        total = ReplayReport(0, 0, 0.0, "")
        done = 0
        while not stop() and (done < playback.loops or playback.loops == 0):
            total = _replay_once(Timeline(path), playback.speed, publishers, total, progress, stop)
            done += 1
        _meet_the_bridge(buses, presences)
        return total


def _names(path: Path, config: BusConfig, robots: Sequence[str]) -> dict[str, str]:
    """The namespace on the bus of each robot that is replayed, by that in the recording."""
    recorded = recorded_robots(path)
    if len(recorded) <= 1:
        return {"".join(recorded): config.namespace}
    for robot in robots:
        if robot not in recorded:
            raise RecordingError(f"{path}: has no robot {robot}, but {', '.join(recorded)}")
    return {robot: robot for robot in robots or recorded}


def _meet_the_bridge(buses: Sequence[Bus], presences: Sequence[Presence]) -> None:
    """Know, if there is a bridge, which may be recording, that it listens and has all that we have sent."""
    for bus, presence in zip(buses, presences, strict=True):
        shake_hands(bus, presence, {topics.BRIDGE}, _HANDSHAKE_TIMEOUT_S)


def _replay_once(
    timeline: Timeline,
    speed: float,
    publishers: Mapping[tuple[str, str], Publisher],
    before: ReplayReport,
    progress: Callable[[float, float], None] | None,
    stop: Callable[[], bool],
) -> ReplayReport:
    """One pass over a recording, added to the report of those ``before``."""
    sent, at_s = 0, 0.0
    begun_s, report_s = time.monotonic(), 0.0
    for cue in timeline.cues():
        publisher = publishers.get((cue.namespace, cue.topic.name))
        if publisher is None:  # of a robot that is not replayed
            continue
        due_s = begun_s + cue.at_s / speed if speed > 0 else 0.0
        while not (ended := stop()) and (now_s := time.monotonic()) < due_s:
            time.sleep(min(due_s - now_s, _PROGRESS_PERIOD_S))
        if ended:
            break
        publisher.send_bytes(cue.payload)
        sent, at_s = sent + 1, cue.at_s
        if progress and now_s >= report_s:
            report_s = now_s + _PROGRESS_PERIOD_S
            progress(timeline.reader.fraction, at_s)
    else:
        if progress:
            progress(1.0, at_s)
    problem = timeline.reader.summary.problem
    timeline.close()
    skipped, sim_time_s = before.skipped + timeline.skipped, before.sim_time_s + at_s
    return ReplayReport(before.sent + sent, skipped, sim_time_s, problem, tuple(timeline.reasons))
