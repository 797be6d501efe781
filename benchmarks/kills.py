"""Random SIGKILLs and SIGSTOPs of every process of a system with a job and a recording.

`python -m benchmarks kills`; `runs` is the number of signals, `seed` theirs, `templates` what is painted (with commas).
Every job has to finish, or wait for a person with a reason; recordings have to be whole but for half a second before a
kill, which `slack` multiplies.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import time
from collections import Counter, deque
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Final, NamedTuple

from benchmarks._recordings import verdict
from benchmarks._settings import Small
from benchmarks._system import RUNNING, STATES, Hand, System, SystemLost, running_system
from touchline.bus import Bus
from touchline.schemas import topics
from touchline.schemas.messages import SprayerState, TraversalStatus

_SPEED: Final = 20.0
_STUCK_S: Final = 30.0
"""Of wall clock without progress and without a reason, after which a job counts as stuck."""
_KEPT_S: Final = 0.6
"""Time that a recording may lack before its recorder was killed: its half second, and the time to look."""
_RESTART_S: Final = 60.0
_GOES_ON_S: Final = 10.0
"""Within which a bridge that is started again goes on with its recording in the next part."""
SMALL: Final = Small(
    {"runs": 1, "seed": 15, "templates": "tennis", "slack": 100.0},
    ("# signals in # minutes", "# kill bridge", "# recordings finished"),
)


def main(runs: int = 100, seed: int = 1, templates: str = "soccer-11,soccer-7,tennis", slack: float = 1.0) -> None:
    """Give the signals and print what became of jobs and recordings."""
    work = _Work(tuple(templates.split(",")), _KEPT_S * slack, random.Random(seed))
    figures: Counter[str] = Counter()
    begun = time.monotonic()
    left = runs
    while left > 0:
        with running_system(_SPEED) as system, ExitStack() as stack:
            try:
                victim = _Victim(system, stack, figures, work)
                while left > 0:
                    left -= 1
                    victim.strike()
                victim.conclude()
            except SystemLost as lost:
                _note(figures, f"BAD: the system was lost: {lost}")
    print(f"{runs} signals in {(time.monotonic() - begun) / 60.0:.1f} minutes")
    for what, count in sorted(figures.items()):
        print(f"  {count:4d}  {what}")
    if any(what.startswith("BAD") for what in figures):
        sys.exit(1)


def _note(figures: Counter[str], what: str) -> None:
    figures[what] += 1
    sys.stderr.write(f"{what}\n")
    sys.stderr.flush()


class _Work(NamedTuple):
    """Templates to paint, seconds that a recording may lack, and the source of chance."""

    templates: tuple[str, ...]
    kept_s: float
    chance: random.Random


class _Victim:
    """A system at work, which is struck again and again."""

    def __init__(self, system: System, stack: ExitStack, figures: Counter[str], work: _Work) -> None:
        self._system, self._figures, self._asked, self._chance = system, figures, work, work.chance
        bus = stack.enter_context(Bus.open(topics.OPERATOR, system.config))
        self._hand = Hand(system, bus)
        self._hand.ready()
        for template in work.templates:
            self._hand.plan(template)
        self._inbox = bus.inbox([topics.STATUS, topics.SPRAYER], keep="recent")
        self._times: deque[tuple[float, int]] = deque(maxlen=20_000)
        self._deeds: deque[tuple[float, str]] = deque(maxlen=6)
        self._place, self._moved_s = 0.0, time.monotonic()
        self._recordings = 0
        self._recording: Path | None = None
        self._cut_off, self._begun_s = False, 0.0
        self._template = ""
        self._state, self._reason = -1, ""
        self._not_running_s: float | None = None
        self._job()

    def strike(self) -> None:
        """Let it work for a while, then kill or freeze one of its processes, and bring it to work again."""
        self._work(self._chance.uniform(0.3, 4.0))
        alive = {name: pid for name, pid in self._system.processes().items() if name != topics.SUPERVISOR}
        if not alive:
            raise SystemLost("no service runs")
        name = self._chance.choice(sorted(alive))
        deed = self._chance.choice(("kill", "freeze"))
        self._figures[f"{deed} {name}"] += 1
        self._deeds.append((time.monotonic(), f"{deed} {name}"))
        # A recorder or sender that is frozen is cut off in time, and a sender that is killed takes what it had with it.
        self._cut_off |= "/" in name or (deed == "freeze" and name == topics.BRIDGE)
        written, struck_s = self._parts()[-1:], time.monotonic()
        if deed == "kill":
            with suppress(ProcessLookupError):
                os.kill(alive[name], signal.SIGKILL)
        else:
            self._freeze(alive[name])
        self._recover(alive, written, struck_s)

    def _freeze(self, pid: int) -> None:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGSTOP)
            try:
                self._work(self._chance.uniform(0.1, 3.0))
            finally:
                os.kill(pid, signal.SIGCONT)

    def _recover(self, before: dict[str, int], written: list[Path], struck_s: float) -> None:
        """Wait for restarts, and do what a person would after them."""
        deadline = time.monotonic() + _RESTART_S
        time.sleep(0.2)
        while True:
            self._listen()
            self._hand.ready()
            after = self._system.processes()
            if {name for name in before if "/" not in name} <= set(after):
                break
            if time.monotonic() > deadline:
                raise SystemLost(f"{sorted(set(before) - set(after))} not restarted within {_RESTART_S:.0f} s")
        if after[topics.BRIDGE] != before[topics.BRIDGE]:
            for part in written:
                if part in self._parts():  # else its job has ended meanwhile
                    self._check_broken(part, struck_s)
        if after[topics.ROBOT_SIM] != before[topics.ROBOT_SIM]:
            self._resume()

    def _check_broken(self, part: Path, struck_s: float) -> None:
        """The recorder was killed: what it had written has to be there but for the last half second, and it goes on."""
        found = verdict(part)
        recorded = ((wall_s, time_ns) for wall_s, time_ns in self._times if self._begun_s <= wall_s < struck_s)
        missing = [wall_s for wall_s, time_ns in recorded if time_ns > found.last_ns]
        lost_s = struck_s - missing[0] if missing else 0.0
        self._bad(found.problems, "in a broken recording")
        if lost_s > self._asked.kept_s:
            before = ", ".join(f"{struck_s - then_s:.1f} s {deed}" for then_s, deed in self._deeds)
            _note(self._figures, f"BAD: {part.name} lacks {lost_s:.1f} s before the kill; before it: {before}")
        else:
            self._figures["recordings broken, whole but for the last half second"] += 1
        deadline = time.monotonic() + _GOES_ON_S
        while self._parts()[-1] == part:
            if time.monotonic() > deadline:
                raise SystemLost(f"the recording does not go on after {part.name}")
            self._listen()
            time.sleep(0.01)
        self._begun_s = time.monotonic()
        self._figures["recordings that go on in another part"] += 1

    def _parts(self) -> list[Path]:
        """The files of the recording under way, in their order."""
        if self._recording is None:
            return []
        further = self._recording.parent.glob(f"{self._recording.stem}.part*.mcap")
        return [self._recording, *sorted(further, key=lambda path: int(path.stem.rpartition(".part")[2]))]

    def _resume(self) -> None:
        """The robot's process died: go on where it was."""
        self._listen()
        if problem := self._hand.load(self._template, resume=True):
            words = problem.partition(":")[0] if "journal" not in problem else problem
            _note(self._figures, f"a load with resume was refused: {words[:120]}")
            self._hand.drive(self._template)
        else:
            self._figures["a load with resume was taken"] += 1
            self._hand.drive(self._template, resume=True)
        self._moved_s = time.monotonic()

    def _bad(self, problems: list[str], where: str) -> None:
        for problem in problems:
            _note(self._figures, f"BAD: {where}: {problem[:160]}")

    def _job(self) -> None:
        """Begin the next job."""
        self._template = self._chance.choice(self._asked.templates)
        if self._recording is None:
            self._record()
        self._hand.pace(_SPEED)
        self._hand.drive(self._template)
        self._moved_s = time.monotonic()

    def _record(self) -> None:
        self._recordings += 1
        self._cut_off, self._begun_s = False, time.monotonic()
        self._recording = self._system.recordings / f"kills-{self._recordings}.mcap"
        if problem := self._hand.record(self._recording):
            _note(self._figures, f"BAD: no recording: {problem}")
            self._recording = None

    def _work(self, duration_s: float) -> None:
        """Let the job go on; a person helps where the robot says that it waits for one."""
        deadline = time.monotonic() + duration_s
        while time.monotonic() < deadline:
            self._system.check()
            self._listen()
            if self._state == TraversalStatus.DONE:
                self._finish()
            elif self._state in (TraversalStatus.PAUSED, TraversalStatus.ESTOPPED):
                self._help()
            elif time.monotonic() - self._moved_s > _STUCK_S:
                _note(self._figures, f"BAD: stuck: {STATES.get(self._state, 'silent')}")
                self._hand.drive(self._template)
                self._moved_s = time.monotonic()
            time.sleep(0.01)

    def _help(self) -> None:
        reason = self._reason
        _note(self._figures, f"waits for a person: {reason}" if reason else "BAD: waits without a reason")
        try:
            self._hand.drive(self._template)
        except SystemLost as lost:
            self._system.check()
            _note(self._figures, f"aborted: {lost}")
            self._hand.order(topics.ABORT)
            raise
        self._moved_s = time.monotonic()

    def _finish(self) -> None:
        """A job is done: look at its recording and begin another."""
        self._figures["jobs finished"] += 1
        self._end_recording()
        self._job()

    def _end_recording(self) -> None:
        parts, self._recording = self._parts(), None
        if not parts:
            return
        if problem := self._hand.finish_recording():
            expected = self._cut_off and problem.endswith("messages lost")
            _note(self._figures, f"{'reported' if expected else 'BAD'}: a recording is not whole: {problem}")
        found = verdict(parts[-1])
        if not found.complete:
            _note(self._figures, "BAD: a finished recording is not complete")
        self._bad(found.problems, "in a recording")
        self._figures["recordings finished"] += 1
        for part in parts:
            part.unlink(missing_ok=True)

    def _listen(self) -> None:
        now_s = time.monotonic()
        for _, message in self._inbox.messages():
            if isinstance(message, TraversalStatus):
                stamp = message.header.stamp
                self._times.append((now_s, stamp.sec * 1_000_000_000 + stamp.nanosec))
                self._state, self._reason = message.state, message.reason
                if message.arc_length_m != self._place:
                    self._place, self._moved_s = message.arc_length_m, now_s
                if message.state == RUNNING:
                    self._not_running_s = None
                elif self._not_running_s is None:
                    self._not_running_s = now_s
            elif isinstance(message, SprayerState) and message.valve_open and self._stands_since(now_s - 0.5):
                _note(self._figures, "BAD: the valve is open though the robot does not drive")

    def _stands_since(self, then_s: float) -> bool:
        return self._not_running_s is not None and self._not_running_s < then_s

    def conclude(self) -> None:
        """Stop, and look at the last recording."""
        if problem := self._hand.order(topics.ESTOP):
            _note(self._figures, f"BAD: no emergency stop: {problem}")
        time.sleep(0.5)
        self._listen()
        self._end_recording()
