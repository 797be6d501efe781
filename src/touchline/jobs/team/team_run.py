"""Emulated robots of a team and its coordinator in lockstep, in one process, as fast as possible."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.body_contacts import BodyContacts, body_radius_m
from touchline.coordination.coordination import LOST_S
from touchline.coordination.density import Density
from touchline.coordination.start_poses import free_area, start_poses
from touchline.coordination.tasks import ARRIVED_M, TeamTask
from touchline.jobs.team.hub_guide import HubGuide, TeamListener
from touchline.jobs.team.path_guide import PathGuide
from touchline.jobs.team.team_guide import TeamGuide
from touchline.jobs.team.team_robot import TeamRobot
from touchline.schemas import topics
from touchline.schemas.cdr import encode
from touchline.schemas.errors import CommandRefused, SpecError
from touchline.schemas.messages import String
from touchline.schemas.scenario import Pose2
from touchline.schemas.team import TeamScenario
from touchline.services.robot_sim.settling import SETTLE_TICKS

Floats = NDArray[np.float64]
Progress = Callable[[float, str], None]

_OF_WHEELS: Final = ("wheel-blocked", "wheel-slip", "motor-weak", "encoder-dropout")
_TAKEN: Final = 3.0
"""A robot that stands within so many clearance radii of another's goal has taken it."""
BELIEVED_M: Final = 0.02
"""Position error allowed to a robot that believes to have arrived."""


@dataclass
class TeamTrace:
    """Measurements of a team, against the truth unless stated.

    Attributes:
        times_s: (k,) times of the updates, from the first cells on.
        places: (k, n, 2) places of the robots then (m, map frame).
        cost: (k,) H of these places, by the task's density (m⁴); empty if the team does not spread.
        driven_m: (n,) distance driven by each.
        beyond_walls_s: Robot-seconds in which a body reached beyond a wall.
        contacts: (k,) number so far.
        touched: New contacts: sim time from the first update on (s), and the robots' numbers.
        ended_s: Time from the first cells to the end of the task, or of its time.
    """

    times_s: list[float] = field(default_factory=list)
    places: list[Floats] = field(default_factory=list)
    cost: list[float] = field(default_factory=list)
    driven_m: Floats = field(default_factory=lambda: np.zeros(0))
    beyond_walls_s: float = 0.0
    contacts: list[int] = field(default_factory=list)
    touched: list[tuple[float, frozenset[int]]] = field(default_factory=list)
    ended_s: float = math.nan


class TeamRun:
    """Run of a team in one process.

    Attributes:
        team: The scenario.
        area: The area.
        names: Names of the robots, sorted.
        robots: By name.
        starts: Start of each robot, by name.
        guide: Guidance of the robots.
        contacts: Contacts of the bodies.
        trace: Measurements.
        ticks: Ticks so far.
    """

    def __init__(
        self, team: TeamScenario, *, hashed: bool = False, listener: TeamListener | None = None, threads: int = 1
    ) -> None:
        """Place every robot at its start.

        Args:
            team: The scenario.
            hashed: Whether to compute the hashes of the sessions.
            listener: Called with all messages that would go over the bus.
            threads: Threads that drive robots side by side, one if there is a listener.

        Raises:
            SpecError: The scenario is impossible, such as too small an area.
            CommandRefused: Such a robot cannot be guided.
            PlanningError: It cannot drive the study's paths, if these are requested.
        """
        self.team, self.area, self.names = team, free_area(team), team.names
        self.starts: dict[str, Pose2] = start_poses(team, self.area)
        setups = {name: team.setup(name, self.starts[name]) for name in self.names}
        if listener is not None:
            setup = String(data=team.model_dump_json())
            listener(topics.TEAM_NAMESPACE, [(topics.TEAM_SETUP, encode(setup))])
        heard = {name: partial(listener, name) if listener is not None else None for name in self.names}
        self.robots = {name: TeamRobot(setup, hashed=hashed, listener=heard[name]) for name, setup in setups.items()}
        self.body_radius_m = body_radius_m(team.vehicle)
        if team.radius_m < self.body_radius_m:
            problem = f"is {team.radius_m:g} m, less than the body's {self.body_radius_m:.3f} m"
            raise SpecError("team", "radius_m", problem, "give the body's radius and a margin of some centimetres")
        self.contacts = BodyContacts(len(self.names), self.body_radius_m, self.area)
        self.trace = TeamTrace(driven_m=np.zeros(len(self.names)))
        self.ticks = self._first_tick = 0
        several = min(threads, len(self.names)) if listener is None else 1  # a listener hears one robot after another
        self._shares = [range(first, len(self.names), several) for first in range(several)]
        self.guide: TeamGuide
        if team.avoid == "cells" or team.by_plans:
            self.guide = HubGuide(team, self.area, self.robots, listener)
        else:
            self.guide = PathGuide(team, self.area, self.robots)

    @property
    def task(self) -> TeamTask:
        """The team's task, once it has begun."""
        assert self.guide.task is not None, "the robots know where they are"
        return self.guide.task

    def run(self, progress: Progress = lambda done, doing: None) -> None:
        """Run from the start to the end.

        Raises:
            CommandRefused: A robot is not localized in time.
            PlanningError: There is no path to a goal.
        """
        with ThreadPoolExecutor(len(self._shares)) as threads:
            self._run(threads, progress)

    def _run(self, threads: Executor, progress: Progress) -> None:
        guide, wanted = self.guide, 100.0 * self.team.duration_s
        while guide.task is None:
            self._drive(threads, guide.step_ticks)
            self._talk()
            self._check_not_lost()
        self.trace.driven_m[:] = 0.0
        while not guide.finished(self.ticks):
            self._drive(threads, guide.step_ticks)
            self._talk()
            since = self.ticks - self._first_tick
            progress(since / wanted, f"{len(self.names)} robots, {since / 100:.0f} s")
        self.trace.ended_s = (self.ticks - self._first_tick) / 100.0
        for robot in self.robots.values():
            robot.end()
        self._drive(threads, SETTLE_TICKS)
        for name, robot in self.robots.items():
            if not self._is_frozen(name):
                robot.come_to_rest()

    def _talk(self) -> None:
        """Let the guide exchange messages with the robots; measure if it has updated goals."""
        if self.guide.talk(self.ticks, [name for name in self.names if not self._is_frozen(name)]):
            self._note()

    def _is_frozen(self, name: str) -> bool:
        """Return whether a robot's computer hangs now."""
        now_s = self.ticks / 100.0
        spells = self.team.frozen.get(name, ())
        return any(each.start_s <= now_s < each.start_s + (each.duration_s or math.inf) for each in spells)

    def _check_not_lost(self) -> None:
        if self.ticks > 100 * LOST_S and (lost := self.guide.waits_for):
            raise CommandRefused(f"{lost[0]} is not localized within {LOST_S:g} s: give a world with a position fix")

    def _drive(self, threads: Executor, ticks: int) -> None:
        """Run some ticks of all robots; those in contact have their bumpers triggered, unless contacts are ignored."""
        before = self.places()
        places = np.repeat(before[None], ticks, axis=0)
        list(threads.map(lambda share: self._drive_some(share, places), self._shares))
        self.ticks += ticks
        steps = np.diff(np.concatenate((before[None], places)), axis=0)
        self.trace.driven_m += np.hypot(steps[..., 0], steps[..., 1]).sum(axis=0)
        beyond = ~self.area.holds(places[-1], self.body_radius_m)
        self.trace.beyond_walls_s += float(beyond.sum()) * ticks / 100.0
        touched = self.contacts.look(places)
        if touched:
            self.trace.touched.append(((self.ticks - self._first_tick) / 100.0, frozenset(touched)))
        if self.team.avoid == "none":
            return
        for k in sorted(touched):
            self.robots[self.names[k]].touch()

    def _drive_some(self, share: Iterable[int], places: Floats) -> None:
        """Run some robots: between two exchanges they are independent, so the order does not matter."""
        for k in share:
            if not self._is_frozen(self.names[k]):
                self.robots[self.names[k]].drive(len(places), places[:, k])

    def places(self) -> Floats:
        """Return (n, 2) true places of the robots (m, map frame)."""
        return np.array([self.robots[name].emulator.world.pose[:2] for name in self.names])

    def _note(self) -> None:
        trace, places = self.trace, self.places()
        if not trace.times_s:
            self._first_tick = self.ticks
        trace.times_s.append((self.ticks - self._first_tick) / 100.0)
        trace.places.append(places)
        if (coverage := self.task.coverage) is not None:
            trace.cost.append(coverage.deployment(places).cost)
        trace.contacts.append(len(self.contacts.pairs))

    @property
    def arrived(self) -> NDArray[np.bool_]:
        """Return (n,) whether each robot is truly at its last goal."""
        goals = self.task.last
        wanted = np.array([goals.get(name, tuple(at)) for name, at in zip(self.names, self.places(), strict=True)])
        found: NDArray[np.bool_] = np.hypot(*(self.places() - wanted).T) <= ARRIVED_M + BELIEVED_M
        return found

    @property
    def disobedient(self) -> frozenset[str]:
        """Robots whose wheels at times do not follow their commands: nobody can promise where they go."""
        faults_of = {name: self.team.faults.get(name, ()) for name in self.names}
        return frozenset(name for name, faults in faults_of.items() if any(each.kind in _OF_WHEELS for each in faults))

    def blockages(self) -> dict[str, str]:
        """Return why robots that have not arrived have not, by name; empty text if unknown."""
        lacking = (name for name, there in zip(self.names, self.arrived, strict=True) if not there)
        return {name: self.robots[name].stopped or self._blocked(name) for name in lacking}

    def _blocked(self, name: str) -> str:
        if self._is_frozen(name):
            return "its computer hangs"
        if blockage := self.guide.blockage(name):
            return blockage
        goal = np.array(self.task.last.get(name, (math.nan, math.nan)))
        for other, place in zip(self.names, self.places(), strict=True):
            if other != name and self.robots[other].stopped and np.hypot(*(place - goal)) < _TAKEN * self.team.radius_m:
                return f"{other}, which has stopped, stands at its goal"
        return ""

    @property
    def density(self) -> Density:
        """Return φ of the task."""
        return self.task.density

    @property
    def hashes(self) -> dict[str, str]:
        """Return the hash of each robot's session, if they are computed, by name."""
        return {name: robot.session_hash for name, robot in self.robots.items() if robot.session_hash}
