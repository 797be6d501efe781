"""SIGKILL of a recording's bridge, and of the whole system, at random moments: losses, and readability of the rest.

`python -m benchmarks recording_kills`; `runs` is the number of kills of each kind, `seed` theirs, `speed` the robot's
times real time (9: 5,300 messages a second), `doctor` a command that is given each salvaged file and must end with exit
code 0, `slack` multiplies what a recording may lack.

After each kill: how much of the wall clock before it is missing in the file, by what an observer had heard of the
robot's clock; after that of the bridge, how long it takes until the next part goes on. Each file is salvaged; the
salvaged file must have every message, in the readers of the MCAP project (checksums verified) and of rosbags.
"""

from __future__ import annotations

import os
import random
import shlex
import signal
import statistics
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final, NamedTuple

from mcap.reader import SeekingReader
from rosbags.rosbag2 import Reader

from benchmarks._settings import Small
from benchmarks._system import Hand, System, SystemLost, running_system
from touchline.bus import Bus
from touchline.recordings.reader import RecordingReader
from touchline.recordings.salvage import salvage
from touchline.schemas import topics
from touchline.schemas.messages import Clock, Message, TraversalStatus

_GOES_ON_S: Final = 120.0
_KEPT_S: Final = 0.5
_BEGIN_BYTES: Final = 16 * 1024
"""More than schemas and channels take."""
SMALL: Final = Small(
    {"runs": 1, "template": "tennis", "slack": 100.0},
    (
        "the next part is there after median # s, at most # s",
        *(
            f"{what} killed # times: median # s, at most # s of wall clock lost before the kill"
            for what in ("bridge", "whole system")
        ),
    ),
)


def main(
    runs: int = 20,
    seed: int = 1,
    speed: float = 9.0,
    template: str = "soccer-11",
    slack: float = 1.0,
    doctor: str = "",
) -> None:
    """Kill, read what remains, and print the figures."""
    kills = _Kills(speed, template, random.Random(seed), _Reading(_KEPT_S * slack, shlex.split(doctor), []))
    lost_s = list(_kill_bridges(runs, kills))
    print(f"bridge killed {runs} times: {_spread(lost_s)} of wall clock lost before the kill", flush=True)
    lost_s = [_kill_tree(kills) for _ in range(runs)]
    print(f"whole system killed {runs} times: {_spread(lost_s)} of wall clock lost before the kill")
    problems = kills.reading.problems
    for problem in problems:
        print(f"  BAD: {problem}")
    if problems:
        sys.exit(1)


def _spread(values: list[float]) -> str:
    return f"median {statistics.median(values):.2f} s, at most {max(values):.2f} s"


class _Listener:
    """Listener to the robot's clock that records the wall time of each message."""

    def __init__(self, bus: Bus) -> None:
        self._inbox = bus.inbox([topics.CLOCK, topics.STATUS], keep="recent")
        self._heard: deque[tuple[float, int]] = deque(maxlen=100_000)
        self.done = False

    def listen(self, duration_s: float = 0.0) -> None:
        """Process messages for a duration."""
        deadline = time.monotonic() + duration_s
        while True:
            for _, message in self._inbox.messages():
                self._take(message)
            if time.monotonic() >= deadline:
                return
            time.sleep(0.005)

    def _take(self, message: Message) -> None:
        if isinstance(message, Clock):
            self._heard.append((time.monotonic(), message.clock.sec * 1_000_000_000 + message.clock.nanosec))
        elif isinstance(message, TraversalStatus):
            self.done = message.state == TraversalStatus.DONE

    def heard(self, from_s: float, until_s: float) -> list[tuple[float, int]]:
        """List (wall time, ns of the robot's clock) of messages between two moments."""
        return [each for each in self._heard if from_s <= each[0] < until_s]


class _Reading(NamedTuple):
    """Seconds that a recording may lack, the doctor's command, and what was wrong so far."""

    kept_s: float
    doctor: list[str]
    problems: list[str]


class _Kills(NamedTuple):
    """Pace and template of the job, the source of chance, and how recordings are read afterwards."""

    speed: float
    template: str
    chance: random.Random
    reading: _Reading


class _Kill(NamedTuple):
    """A file whose recorder was killed, when, and what was heard of the robot's clock while it was recorded."""

    path: Path
    at_s: float
    heard: list[tuple[float, int]]

    def lost_s(self, last_ns: int) -> float:
        """Wall clock from the first message that is not in the file to the kill."""
        missing = [at_s for at_s, clock_ns in self.heard if clock_ns > last_ns]
        return self.at_s - missing[0] if missing else 0.0


@contextmanager
def _recorded_job(kills: _Kills) -> Iterator[tuple[System, Hand, _Listener, Path]]:
    """A system that paints and records it."""
    with running_system(kills.speed) as system, Bus.open(topics.OPERATOR, system.config) as bus:
        hand, listener = Hand(system, bus), _Listener(bus)
        path = system.recordings / "killed.mcap"
        hand.record_job(path, kills.template)
        yield system, hand, listener, path


def _kill_bridges(runs: int, kills: _Kills) -> Iterator[float]:
    """Kill the bridge of one recording again and again; a job that is done is followed by another."""
    with _recorded_job(kills) as (system, hand, listener, path):
        part, gaps_s, done, begun_s = path, list[float](), list[_Kill](), time.monotonic()
        for number in range(2, runs + 2):
            until = time.monotonic() + kills.chance.uniform(0.2, 4.0)
            pid = system.processes()[topics.BRIDGE]
            while time.monotonic() < until:
                _keep_going(hand, kills.template, listener, 0.05)
            killed_s = time.monotonic()
            os.kill(pid, signal.SIGKILL)
            following = path.with_name(f"{path.stem}.part{number}.mcap")
            while not _goes_on(following):
                if time.monotonic() - killed_s > _GOES_ON_S:
                    raise SystemLost(f"the recording does not go on after {part.name}")
                _keep_going(hand, kills.template, listener, 0.01)
            done.append(_Kill(part, killed_s, listener.heard(begun_s, killed_s)))
            part, begun_s = following, time.monotonic()
            gaps_s.append(begun_s - killed_s)
        print(f"the next part is there after {_spread(gaps_s)}", flush=True)
        listener.listen(1.0)
        if problem := hand.finish_recording():
            kills.reading.problems.append(f"the last part: {problem}")
        # Only now: what is still recorded meanwhile would have to be read, too.
        for kill in done:
            yield _lost_before_kill_s(kill, kills.reading)
        _look(path, kills.reading)


def _keep_going(hand: Hand, template: str, listener: _Listener, duration_s: float) -> None:
    """Listen for so long; a job that is done is followed by another."""
    if listener.done:
        hand.drive(template)
    listener.listen(duration_s)


def _goes_on(part: Path) -> bool:
    """True if a part has messages already, and not only its begin."""
    return part.exists() and part.stat().st_size > _BEGIN_BYTES


def _kill_tree(kills: _Kills) -> float:
    """Kill every process of a system that records."""
    with _recorded_job(kills) as (system, _, listener, path):
        pids = (system.supervisor.pid, *system.processes().values())
        begun_s = time.monotonic()
        listener.listen(kills.chance.uniform(0.2, 6.0))
        killed_s = time.monotonic()
        for pid in pids:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        listener.listen(0.5)
        return _lost_before_kill_s(_Kill(path, killed_s, listener.heard(begun_s, killed_s)), kills.reading)


def _lost_before_kill_s(kill: _Kill, reading: _Reading) -> float:
    """Wall-clock time missing before the kill; problems of the file are added to the reading."""
    lost_s = kill.lost_s(_look(kill.path, reading, alone=True))
    if lost_s > reading.kept_s:
        reading.problems.append(f"{kill.path.name} lacks {lost_s:.2f} s")
    return lost_s


def _look(path: Path, reading: _Reading, *, alone: bool = False) -> int:
    """Read and salvage a file, and add foreign readers' problems; return its last clock (ns)."""
    given = path
    if alone:  # the name of a recording stands for its further parts, too
        given = path.with_name(f"alone-{path.stem.replace('.', '-')}.mcap")
        given.write_bytes(path.read_bytes())
    messages, last_ns = 0, 0
    for message in RecordingReader(given).messages():
        messages += 1
        if message.topic.endswith("/clock"):
            last_ns = max(last_ns, message.publish_time_ns)
    whole = given.with_name(f"whole-{given.stem.replace('.', '-')}.mcap")
    salvage(given, whole)
    found = _foreign_problems(whole, messages, reading.doctor)
    reading.problems.extend(f"{given.name}: {problem}" for problem in found)
    return last_ns


def _foreign_problems(whole: Path, messages: int, doctor: list[str]) -> Iterator[str]:
    with whole.open("rb") as stream:
        found = sum(1 for _ in SeekingReader(stream, validate_crcs=True).iter_messages())
    if found != messages:
        yield f"the MCAP project's reader finds {found} of {messages} messages"
    with Reader(whole) as reader:
        found = sum(1 for _ in reader.messages())
    if found != messages:
        yield f"rosbags finds {found} of {messages} messages"
    if doctor:
        done = subprocess.run([*doctor, str(whole)], capture_output=True, text=True, check=False)
        if done.returncode:
            yield f"the doctor ends with {done.returncode}: {(done.stdout + done.stderr).strip()[-200:]}"
