"""Coordinator of a team killed again and again beside a standby: how long until robots are guided, and contacts.

`python -m benchmarks takeovers`: `robots` emulated robots at real time drive to one goal after another (by `seed`) in 5
× 5 m. The coordinator gets SIGKILL `kills` times, two to four seconds after all are guided; each time its standby takes
over, and another one is started. All are processes on one bus. `avoid` is one way to keep apart. Robots are in
lockstep; with `lockstep=0`, only by cells, they are not, as real ones: the clock of one that waited for a processor is
late then, so places are compared as they come, not by ticks.

Columns, in wall-clock time from the kill, median and most: until the standby is the coordinator, until it sends a robot
its first cell or plan, until the first robot reports that it follows that, until all do. Then the longest time that a
robot stood until all drove again, by its own clock, and for how long the standby waited for a processor until all
followed: nothing on a machine with cores to spare. Contacts are of true places at 50 Hz, all the time: of two robots
(bodies touch at 0.354 m), and with walls. Robots that their watchdogs paused, as the machine is too busy for them, are
resumed: `paused` is how often.
"""

from __future__ import annotations

import os
import random
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from benchmarks._processes import waited_s
from benchmarks._settings import Small
from benchmarks._system import COMMAND, new_id
from benchmarks._true_drives import TrueDrives
from touchline.bus import Bus, BusConfig
from touchline.bus.attachment import session_publisher
from touchline.bus.health import STARTING
from touchline.bus.ports import free_port
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.fleet import Fleet
from touchline.schemas.team import TeamScenario

AVOID: Final = ("cells", "plans", "barriers")
SMALL: Final = Small(
    {"robots": 2, "kills": 1, "avoid": "plans"}, ("plans 1 # # # # # # # # # # # # # 0 0 #", "0 contacts")
)
_SIDE_M: Final = 5.0
_GOALS: Final = 200
_PATIENCE_S: Final = 180.0
_LOOK_S: Final = 0.002
_CALM_S: Final = 0.5
"""Time for which a standby waits for a processor beyond which a takeover says more of the machine."""


def main(robots: int = 4, kills: int = 10, seed: int = 1, avoid: str = "", lockstep: int = 1) -> None:
    """Print a row for each way to keep apart; exit code 1 if robots touched."""
    print(f"{robots} robots at real time; seconds from the kill, median and most")
    print(
        "by        kills  coordinator    first sent     first follows  all follow     stood          waited         ",
        end="",
    )
    print("closest  touch  walls  paused")
    contacts = 0
    for way in (avoid,) if avoid else AVOID:
        with ExitStack() as stack:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
            team = _Team(stack, folder, _scenario(robots, way, random.Random(seed)), lockstep=bool(lockstep))
            found = [team.takeover() for _ in range(kills)]
        columns = [f"{np.median(each):6.2f} {max(each):6.2f}" for each in zip(*found, strict=True)]
        touch, walls = team.drives.contacts
        counts = f"{touch:5}  {walls:5}  {team.paused:6}"
        print(f"{way:8}  {kills:5}  {'  '.join(columns)}  {team.drives.closest_m:7.3f}  {counts}", flush=True)
        if calm := [each.all_follow_s for each in found if each.waited_s < _CALM_S]:
            told = f"all follow after {np.median(calm):.2f} s, most {max(calm):.2f} s"
            print(
                f"          {len(calm)} of them with a standby that waited for less than {_CALM_S:g} s: {told}",
                flush=True,
            )
        contacts += touch + walls
    print(f"{contacts} contacts")
    if contacts:
        sys.exit(1)


class _Takeover(NamedTuple):
    """Times of a takeover from the kill on, how long a robot stood, and the standby waited for a processor (s)."""

    coordinates_s: float
    sent_s: float
    first_follows_s: float
    all_follow_s: float
    stood_s: float
    waited_s: float


@dataclass
class _Watch:
    """Times at which a coordinator that follows another is first heard of, and followed.

    Attributes:
        former: Session of the other one; "": none.
        coordinates_s: Time when it became the coordinator; 0: not yet.
        sent_s: Time when it first sent a cell or plan; 0: not yet.
        follow_s: Times when robots first reported to follow what it had sent.
    """

    former: str = ""
    coordinates_s: float = 0.0
    sent_s: float = 0.0
    follow_s: dict[str, float] = field(default_factory=dict)
    _sent: defaultdict[str, set[int]] = field(default_factory=lambda: defaultdict(set))
    _begun: set[str] = field(default_factory=set)

    def note(self, name: str, publisher: bytes, message: m.Message, now_s: float) -> None:
        """Note a message to or from a robot."""
        if isinstance(message, m.Guidance) and message.number and publisher != session_publisher(self.former):
            self.sent_s = self.sent_s or now_s
            self._sent[name].add(message.number)
        elif isinstance(message, m.PlanState | m.Whereabouts):
            if message.adopted == 0:
                self._begun.add(name)
            anew = isinstance(message, m.PlanState) or name in self._begun  # cells are counted anew, plans are not
            if anew and message.adopted in self._sent[name]:
                self.follow_s.setdefault(name, now_s)


class _Team:
    """Robots, their coordinator and a standby, each a process, and what an observer hears of them.

    Attributes:
        drives: True drives of the robots.
        paused: How often robots have been resumed.
    """

    def __init__(self, stack: ExitStack, folder: Path, team: TeamScenario, *, lockstep: bool) -> None:
        self._stack, self._folder, self._chance = stack, folder, random.Random(1)
        self._names, self._lockstep = team.names, ("--lockstep",) if lockstep else ()
        self._config = BusConfig(endpoint=f"tcp/127.0.0.1:{free_port()}", namespaces=(topics.TEAM_NAMESPACE,))
        (folder / "team.json").write_text(team.model_dump_json())
        setups = {name: team.setup(name, team.places[name]) for name in team.names}
        (folder / "fleet.json").write_text(Fleet.of(setups).model_dump_json())
        self._started = 0
        self._start("robot-sim", "--robots", str(folder / "fleet.json"), "--speed", "1")
        self._coordinator, self._standby = self._coordinate(), self._coordinate("--standby")
        bus = self._bus = stack.enter_context(Bus.open(topics.OPERATOR, self._config))
        self._heard = bus.inbox([topics.DIAGNOSTICS], keep="recent")
        reported = (topics.PLAN_STATE, topics.WHEREABOUTS, topics.STATUS, topics.DIAGNOSTICS)
        heard = [topics.TRUTH, topics.GUIDANCE, *reported]
        self._inboxes = {name: bus.of(name).inbox(heard, keep="recent") for name in team.names}
        self.drives, self._watch = TrueDrives(team.names, _SIDE_M, in_step=lockstep), _Watch()
        self._stands_by, self._ready, self.paused = False, set[str](), 0
        self._until(lambda: self._stands_by and self._ready == set(team.names))
        task = m.TeamTaskRequest(request_id=new_id(), task_json=team.task.model_dump_json())
        if not (answer := bus.call(topics.TEAM_TASK, task, _PATIENCE_S)).success:
            sys.exit(answer.message)

    def _start(self, *words: str) -> subprocess.Popen[bytes]:
        self._started += 1
        environment = {**os.environ, **self._config.environment(), "XDG_STATE_HOME": str(self._folder)}
        with (self._folder / f"{self._started}.log").open("wb") as log:
            command = [*COMMAND, *words]
            process = subprocess.Popen(command, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        return process

    def _coordinate(self, *more: str) -> subprocess.Popen[bytes]:
        return self._start("coordinator", "--team", str(self._folder / "team.json"), *self._lockstep, *more)

    def takeover(self) -> _Takeover:
        """Kill the coordinator under way, and wait until all robots have driven by the standby's guidance."""
        self._until(lambda: self._stands_by and self._all_follow)
        until_s = time.monotonic() + self._chance.uniform(2.0, 4.0)
        self._until(lambda: time.monotonic() > until_s)
        (session,) = self._bus.sessions(topics.COORDINATOR)
        since_ticks, watch, before_s = self.drives.ticks, _Watch(session), waited_s(self._standby.pid)
        self._coordinator.kill()
        killed_s, self._watch, self._stands_by = time.monotonic(), watch, False
        self._coordinator.wait()
        self._until(lambda: self._all_follow)
        times_s = watch.coordinates_s, watch.sent_s, min(watch.follow_s.values()), max(watch.follow_s.values())
        if list(times_s) != sorted(times_s):
            sys.exit(f"BAD: robots followed before they were told, or those told them who did not coordinate: {watch}")
        waits_s = waited_s(self._standby.pid) - before_s
        told_ticks, drove = self.drives.ticks, self.drives.drove_ticks
        self._until(lambda: all(drove[name] > told_ticks[name] for name in self._names))
        stood_s = max(self.drives.stood_s(name, since_ticks[name], told_ticks[name]) for name in self._names)
        self._coordinator, self._standby = self._standby, self._coordinate("--standby")
        coordinates_s, sent_s, first_s, all_s = (each_s - killed_s for each_s in times_s)
        return _Takeover(coordinates_s, sent_s, first_s, all_s, stood_s, waits_s)

    @property
    def _all_follow(self) -> bool:
        return len(self._watch.follow_s) == len(self._names)

    def _until(self, condition: Callable[[], bool]) -> None:
        deadline_s = time.monotonic() + _PATIENCE_S
        while not condition():
            if time.monotonic() > deadline_s:
                logs = "\n".join(file.read_text() for file in sorted(self._folder.glob("*.log")))
                sys.exit(f"not within {_PATIENCE_S:g} s: {self._ready} are ready; {self._watch}\n{logs}")
            time.sleep(_LOOK_S)
            self._look()

    def _look(self) -> None:
        now_s, watch = time.monotonic(), self._watch
        if not watch.coordinates_s and self._bus.sessions(topics.COORDINATOR) - {watch.former}:
            watch.coordinates_s = now_s
        for _, message in self._heard.messages():
            if isinstance(message, m.DiagnosticArray) and message.status[0].name == topics.STANDBY:
                self._stands_by = message.status[0].message.startswith("stands by for session")
        for name, inbox in self._inboxes.items():
            for sample, message in inbox.messages():
                watch.note(name, sample.publisher, message, now_s)
                if isinstance(message, m.Odometry):
                    self.drives.take(name, message)
                elif isinstance(message, m.TraversalStatus) and message.state == m.TraversalStatus.PAUSED:
                    request = m.CommandRequest(request_id=new_id())
                    self.paused += self._bus.of(name).call(topics.RESUME, request, _PATIENCE_S).success
                elif isinstance(message, m.DiagnosticArray) and message.status[0].name == topics.ROBOT_SIM:
                    self._ready |= set() if message.status[0].message.startswith(STARTING) else {name}


def _scenario(robots: int, avoid: str, chance: random.Random) -> TeamScenario:
    """Robots on a circle, each with one goal after another anywhere."""
    names = [f"tb{number}" for number in range(1, robots + 1)]
    angles = [2.0 * np.pi * number / robots for number in range(robots)]
    places = {
        name: {"x_m": 2.5 + 1.8 * np.cos(angle), "y_m": 2.5 + 1.8 * np.sin(angle), "heading_rad": 0.0}
        for name, angle in zip(names, angles, strict=True)
    }
    goals = {name: [(chance.uniform(0.6, 4.4), chance.uniform(0.6, 4.4)) for _ in range(_GOALS)] for name in names}
    area = {"outline": [(0.0, 0.0), (_SIDE_M, 0.0), (_SIDE_M, _SIDE_M), (0.0, _SIDE_M)]}
    task = {"kind": "goals", "goals": goals}
    given = {"places": places, "area": area, "task": task, "avoid": avoid, "duration_s": 3000.0}
    return TeamScenario.model_validate(given)
