"""A team of emulated robots and its coordinator in lockstep, in one process, as fast as it goes."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.schemas.errors import CommandRefused, SpecError
from touchline.schemas.faults import parse_fault
from touchline.schemas.scenario import Pose2
from touchline.schemas.team import TeamScenario
from touchline.services.fleet.density import Density
from touchline.services.fleet.lloyd import deployment
from touchline.services.fleet.starts import free_area, starts
from touchline.services.fleet.tasks import ARRIVED_M, Deploy, GoalLists, TeamTask, task_of
from touchline.services.runs.team.body_contacts import BodyContacts
from touchline.services.runs.team.cell_guide import CellGuide
from touchline.services.runs.team.path_guide import PathGuide
from touchline.services.runs.team.team_guide import TeamGuide
from touchline.services.runs.team.team_robot import TeamRobot

Floats = NDArray[np.float64]
Progress = Callable[[float, str], None]

LOST_S: Final = 30.0
"""Sim time: robots that stand for so long without knowing where will not drive."""
_TOUCH_S: Final = 1.0


@dataclass
class TeamTrace:
    """What was measured of a team, against the truth.

    Attributes:
        times_s: (k,) of the updates, from the first cells on.
        places: (k, n, 2) of the robots then (m).
        cost: (k,) H of these places, by the task's density or even (m⁴).
        contacts: (k,) so far.
        driven_m: (n,) how far each has driven.
        beyond_walls_s: Robot-seconds in which a body reached beyond a wall.
        touched: When which robots have come to touch another: sim time from the first update on (s), and their numbers.
        arrived_s: When all had come to their last goals.
    """

    times_s: list[float] = field(default_factory=list)
    places: list[Floats] = field(default_factory=list)
    cost: list[float] = field(default_factory=list)
    contacts: list[int] = field(default_factory=list)
    driven_m: Floats = field(default_factory=lambda: np.zeros(0))
    beyond_walls_s: float = 0.0
    touched: list[tuple[float, frozenset[int]]] = field(default_factory=list)
    arrived_s: float = math.nan


class TeamRun:
    """See the module.

    Attributes:
        team: The scenario.
        area: Where.
        names: Of the robots, sorted.
        robots: By name.
        starts: Where each stands at the start, by name.
        guide: That tells them where to drive.
        contacts: Of the bodies.
        trace: What was measured.
        ticks: So far.
    """

    def __init__(self, team: TeamScenario, *, hashed: bool = False) -> None:
        """Everybody at its start.

        Raises:
            SpecError: The scenario cannot be, such as too small an area.
            CommandRefused: Such a robot cannot be guided.
            PlanningError: It cannot drive the study's paths, if these are wanted.
        """
        self.team, self.area, self.names = team, free_area(team), team.names
        self.starts: dict[str, Pose2] = starts(team, self.area)
        setups = {name: team.setup(name, self.starts[name]) for name in self.names}
        self.robots = {name: TeamRobot(setup, hashed=hashed) for name, setup in setups.items()}
        self.body_radius_m = float(np.hypot(*np.array(team.vehicle.body.footprint_m).T).max())
        if team.radius_m < self.body_radius_m:
            problem = f"is {team.radius_m:g} m, less than the body's {self.body_radius_m:.3f} m"
            raise SpecError("team", "radius_m", problem, "give the body's radius and a margin of some centimetres")
        self.contacts = BodyContacts(len(self.names), self.body_radius_m)
        self.trace = TeamTrace(driven_m=np.zeros(len(self.names)))
        cells = team.avoid == "cells"
        self.guide: TeamGuide = CellGuide(team, self.area, self.robots) if cells else PathGuide(team, self.robots)
        self.ticks = self._first_tick = 0
        self._update_ticks = round(100 * team.update_s)
        self._task: TeamTask | None = None
        self._density = Deploy(self.area)

    @property
    def task(self) -> TeamTask:
        """What the team does, once it has begun."""
        assert self._task is not None, "the robots know where they are"
        return self._task

    def run(self, progress: Progress = lambda done, doing: None) -> None:
        """From the start to the end.

        Raises:
            CommandRefused: A robot does not find out where it stands.
            SegmentsMeet: A robot has not kept to its cell.
            PlanningError: There is no way to a goal.
        """
        self._begin()
        guide, first = self.guide, self.ticks
        last = first + round(100 * self.team.duration_s)
        while self.ticks < last:
            since = self.ticks - first
            update = since % self._update_ticks == 0
            guide.talk(self.ticks, update=update)
            if update:
                self._note(since / 100.0)
                progress(since / (last - first), f"{len(self.names)} robots, {since / 100:.0f} s")
                if not math.isnan(self.trace.arrived_s):
                    return
            self._drive(guide.step_ticks)

    def _begin(self) -> None:
        """Let all find out where they are."""
        while len(places := self.guide.places()) < len(self.names):
            if self.ticks > 100 * LOST_S:
                lost = next(name for name in self.names if name not in places)
                raise CommandRefused(
                    f"{lost} does not find out where it stands within {LOST_S:g} s: give a world with a position fix"
                )
            self._drive(self._update_ticks)
        self._first_tick = self.ticks
        self.trace.driven_m[:] = 0.0
        self._task = task_of(self.team.task, self.area, places)
        if isinstance(self._task, Deploy):
            self._density = self._task
        self.guide.begin(self._task, self.ticks)

    def _drive(self, ticks: int) -> None:
        """Let ticks pass for all; who touches another has its bumper pressed from then on, unless nobody cares."""
        before = self.places()
        places = np.zeros((ticks, len(self.names), 2))
        for k, name in enumerate(self.names):
            self.robots[name].drive(ticks, places[:, k])
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
        for k in touched:
            press = parse_fault(f'{{"kind": "bumper", "duration_s": {_TOUCH_S}}}')
            self.robots[self.names[k]].emulator.inject_fault(press)

    def places(self) -> Floats:
        """(n, 2) where the robots truly are (m)."""
        return np.array([self.robots[name].emulator.world.pose[:2] for name in self.names])

    def _note(self, time_s: float) -> None:
        trace, places = self.trace, self.places()
        trace.times_s.append(time_s)
        trace.places.append(places)
        trace.cost.append(deployment(places, self.area, self.density).cost)
        trace.contacts.append(self.contacts.count)
        if isinstance(self.task, GoalLists) and self.arrived.all():
            trace.arrived_s = time_s

    @property
    def arrived(self) -> NDArray[np.bool_]:
        """(n,) who truly is at its last goal."""
        goals = self.task.last if isinstance(self.task, GoalLists) else {}
        wanted = np.array([goals.get(name, tuple(at)) for name, at in zip(self.names, self.places(), strict=True)])
        found: NDArray[np.bool_] = np.hypot(*(self.places() - wanted).T) <= ARRIVED_M
        return found

    @property
    def density(self) -> Density:
        """φ of the task, or an even one."""
        return self._density.density

    @property
    def hashes(self) -> dict[str, str]:
        """Of each robot's session, if they are worked out, by name."""
        told = {name: robot.telemetry for name, robot in self.robots.items()}
        return {name: each.digest.hexdigest() for name, each in told.items() if each is not None}

    @property
    def session_hash(self) -> str:
        """Of all robots' sessions, whatever the order in which they are listed; empty if they are not worked out."""
        lines = "".join(f"{name} {digest}\n" for name, digest in sorted(self.hashes.items()))
        return hashlib.sha256(lines.encode()).hexdigest()[:16] if lines else ""
