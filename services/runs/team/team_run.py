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
from touchline.schemas.messages import Guidance, Whereabouts
from touchline.schemas.scenario import Pose2
from touchline.schemas.team import TeamScenario
from touchline.services.fleet.coordination import LOST_S, Coordination
from touchline.services.fleet.density import Density
from touchline.services.fleet.hub import Hub
from touchline.services.fleet.lloyd import EVEN, deployment
from touchline.services.fleet.radio import Radio
from touchline.services.fleet.starts import free_area, starts
from touchline.services.fleet.tasks import ARRIVED_M, Deploy, GoalLists, TeamTask
from touchline.services.runs.team.body_contacts import BodyContacts
from touchline.services.runs.team.team_robot import TeamRobot

Floats = NDArray[np.float64]
Progress = Callable[[float, str], None]

SAYING_TICKS: Final = 10
"""Between two messages of a robot, where messages may be lost or late."""
_TOUCH_S: Final = 1.0
_TO_HUB, _TO_ROBOTS = 0, 1


@dataclass
class TeamTrace:
    """What was measured of a team, against the truth where not said otherwise.

    Attributes:
        times_s: (k,) of the updates, from the first cells on.
        places: (k, n, 2) of the robots then (m).
        cost: (k,) H of these places, by the task's density or even (m⁴).
        driven_m: (n,) how far each has driven.
        beyond_walls_s: Robot-seconds in which a body reached beyond a wall.
        nearest_segments_m: The least distance of two stopping segments at an update, as the robots believe.
        outside_cell_m: How far a stopping segment was outside the cell that its robot kept to, at most, likewise.
        arrived_s: When all had come to their last goals.
    """

    times_s: list[float] = field(default_factory=list)
    places: list[Floats] = field(default_factory=list)
    cost: list[float] = field(default_factory=list)
    driven_m: Floats = field(default_factory=lambda: np.zeros(0))
    beyond_walls_s: float = 0.0
    nearest_segments_m: float = math.inf
    outside_cell_m: float = -math.inf
    arrived_s: float = math.nan


class TeamRun:
    """See the module.

    Attributes:
        team: The scenario.
        area: Where.
        names: Of the robots, sorted.
        robots: By name.
        starts: Where each stands at the start, by name.
        contacts: Of the bodies.
        trace: What was measured.
        ticks: So far.
    """

    def __init__(self, team: TeamScenario, *, hashed: bool = False) -> None:
        """Everybody at its start.

        Raises:
            SpecError: The scenario cannot be, such as too small an area.
            CommandRefused: Such a robot cannot be guided.
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
        self.ticks = 0
        self._update_ticks = round(100 * team.update_s)
        self._coordination = Coordination(team, self.area)
        self._to_hub: Radio[Whereabouts] = Radio(team.links, team.world.seed, _TO_HUB)
        self._to_robots: Radio[Guidance] = Radio(team.links, team.world.seed, _TO_ROBOTS)
        self._begun_s = math.nan

    @property
    def task(self) -> TeamTask:
        """What the team does, once it has begun."""
        assert self._coordination.task is not None, "the robots know where they are"
        return self._coordination.task

    def run(self, progress: Progress = lambda done, doing: None) -> None:
        """From the start to the end.

        Raises:
            CommandRefused: A robot does not find out where it stands, or cannot be guided.
            SegmentsMeet: A robot has not kept to its cell.
        """
        for robot in self.robots.values():
            robot.begin_guided()
        step = self._update_ticks if self.team.links.lossless else SAYING_TICKS
        while self._coordination.hub is None:
            self._drive(step)
            self._exchange()
            self._check_not_lost()
        self.trace.driven_m[:] = 0.0
        first, last = self.ticks, self.ticks + round(100 * self.team.duration_s)
        while self.ticks < last and math.isnan(self.trace.arrived_s):
            self._drive(step)
            self._exchange()
            since = self.ticks - first
            progress(since / (last - first), f"{len(self.names)} robots, {since / 100:.0f} s")

    def _exchange(self) -> None:
        """Messages there, an update if it is due, and messages back."""
        tick, now_s, coordination = self.ticks, self.ticks / 100.0, self._coordination
        for name in self.names:
            if (said := self.robots[name].emulator.onboard.whereabouts) is not None:
                self._to_hub.send(tick, name, said)
        for name, said in self._to_hub.arrived(tick):
            coordination.hear(name, said, now_s)
        if tick % self._update_ticks == 0:
            coordination.update(now_s)
            if coordination.hub is not None:
                self._note(coordination.hub)
        for name, told in coordination.say().items():
            self._to_robots.send(tick, name, told)
        for name, told in self._to_robots.arrived(tick):
            self.robots[name].emulator.onboard.take_guidance(told)

    def _check_not_lost(self) -> None:
        if self.ticks > 100 * LOST_S and (lost := self._coordination.waits_for):
            raise CommandRefused(
                f"{lost[0]} does not find out where it stands within {LOST_S:g} s: give a world with a position fix"
            )

    def _drive(self, ticks: int) -> None:
        """Let ticks pass for all; who touches another has its bumper pressed from then on."""
        before = self.places()
        places = np.zeros((ticks, len(self.names), 2))
        for k, name in enumerate(self.names):
            self.robots[name].drive(ticks, places[:, k])
        self.ticks += ticks
        steps = np.diff(np.concatenate((before[None], places)), axis=0)
        self.trace.driven_m += np.hypot(steps[..., 0], steps[..., 1]).sum(axis=0)
        beyond = ~self.area.holds(places[-1], self.body_radius_m)
        self.trace.beyond_walls_s += float(beyond.sum()) * ticks / 100.0
        for k in self.contacts.look(places):
            press = parse_fault(f'{{"kind": "bumper", "duration_s": {_TOUCH_S}}}')
            self.robots[self.names[k]].emulator.inject_fault(press)

    def places(self) -> Floats:
        """(n, 2) where the robots truly are (m)."""
        return np.array([self.robots[name].emulator.world.pose[:2] for name in self.names])

    def _note(self, hub: Hub) -> None:
        trace, places = self.trace, self.places()
        if not trace.times_s:
            self._begun_s = self.ticks / 100.0
        time_s = self.ticks / 100.0 - self._begun_s
        trace.times_s.append(time_s)
        trace.places.append(places)
        trace.cost.append(deployment(places, self.area, self.density).cost)
        trace.nearest_segments_m = min(trace.nearest_segments_m, hub.nearest_segments_m)
        trace.outside_cell_m = max(trace.outside_cell_m, *hub.strays_m.values())
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
        return self.task.density if isinstance(self.task, Deploy) else EVEN

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
