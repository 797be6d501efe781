"""Task of a team whose robots drive as an algorithm wishes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.algorithms.algorithm_loading import EXTERNAL, algorithm_of, is_distributed, made
from touchline.coordination.algorithms.deciders import CentralDecider, Decider, RobotDeciders
from touchline.coordination.algorithms.peer_radio import PeerRadio
from touchline.coordination.algorithms.team_algorithm import GoalWish, Hold, Me, PathWish, Team, Wish
from touchline.coordination.algorithms.wish_geometry import aim_of, velocity_of
from touchline.coordination.coverage import TeamCoverage
from touchline.coordination.density import Density
from touchline.coordination.free_area import FreeArea
from touchline.coordination.tasks import TeamTask
from touchline.schemas.errors import SpecError
from touchline.schemas.team import TeamScenario

Floats = NDArray[np.float64]
External = Callable[[PeerRadio], Decider]


class AlgorithmTask:
    """Task whose goals are the wishes of an algorithm; what it is for is another task, which the algorithm may read.

    Attributes:
        decider: The algorithm.
        given: The task that the team was given.
    """

    def __init__(self, team: TeamScenario, area: FreeArea, given: TeamTask, decider: Decider) -> None:
        """Ask an algorithm for the wishes of a team from now on."""
        self._team, self._area = team, area
        self._updates = 0
        self.decider, self.given = decider, given

    @property
    def use(self) -> str:
        """Name or file of the algorithm."""
        return "" if self._team.algorithm is None else self._team.algorithm.use

    @property
    def last(self) -> Mapping[str, tuple[float, float]]:
        """Last goals of the given task, as of `TeamTask`."""
        return self.given.last

    @property
    def ends_on_arrival(self) -> bool:
        """True if the given task ends on arrival, as of `TeamTask`."""
        return self.given.ends_on_arrival

    @property
    def density(self) -> Density:
        """φ of the given task, as of `TeamTask`."""
        return self.given.density

    @property
    def coverage(self) -> TeamCoverage | None:
        """Rule of the given task, as of `TeamTask`."""
        return self.given.coverage

    def wishes(self, names: Sequence[str], states: Floats) -> dict[str, Wish]:
        """Return the wish of each robot; to be called once per update.

        Args:
            names: Names of n robots.
            states: (n, 4) x, y (m), heading (rad), speed (m/s).
        """
        team, now_s = self._team, self._updates * self._team.update_s
        self._updates += 1
        goals = self.given.goals(names, states) if self.given.last else None
        importance = self.density.at
        robots = {
            name: Me(
                name=name,
                team=team.names,
                now_s=now_s,
                period_s=team.update_s,
                x_m=x,
                y_m=y,
                heading_rad=heading,
                vx_mps=speed * math.cos(heading),
                vy_mps=speed * math.sin(heading),
                goal_m=None if goals is None else (float(goals[k, 0]), float(goals[k, 1])),
                importance=importance(x, y),
                speed_max_mps=team.vehicle.drive.transit_speed_mps,
                radius_m=team.radius_m,
                range_m=team.radio.range_m,
                area=self._area,
                seed=team.world.seed,
            )
            for k, (name, (x, y, heading, speed)) in enumerate(zip(names, states.tolist(), strict=True))
        }
        return self.decider.wishes(Team(now_s, MappingProxyType(robots), importance))

    def goals(self, names: Sequence[str], states: Floats) -> Floats:
        """Return a goal for each wish, as of `TeamTask`: for a velocity a place from which a robot would brake."""
        wishes, team = self.wishes(names, states), self._team
        drive, period_s = team.vehicle.drive, team.update_s

        def goal_of(wish: Wish, state: list[float]) -> complex:
            here = complex(*state[:2])
            if isinstance(wish, Hold):
                return here
            if isinstance(wish, GoalWish | PathWish):
                return aim_of(wish, here)
            velocity = velocity_of(wish, state[2], period_s)
            speed_mps = abs(velocity)
            ahead_s = speed_mps / (2.0 * drive.max_acceleration_mps2) + period_s
            return here + velocity * ahead_s

        found = [goal_of(wishes[name], state) for name, state in zip(names, states.tolist(), strict=True)]
        return np.array([(place.real, place.imag) for place in found]).reshape(-1, 2)


def task_with_algorithm(
    team: TeamScenario, area: FreeArea, given: TeamTask, external: External | None
) -> AlgorithmTask:
    """Return the task of a team whose scenario names an algorithm.

    Args:
        team: The scenario.
        area: The area.
        given: The task that it is for.
        external: Makes the decider that asks other processes, where there is a bus.

    Raises:
        SpecError: There is none of that name, it cannot be made, or it needs a bus.
        BrokenPlugin: It is of another package, which fails to import it.
    """
    assert team.algorithm is not None, "the team has an algorithm"
    radio = PeerRadio(team.radio, team.number_of, area, team.world.seed, team.update_s)
    if team.algorithm.use == EXTERNAL:
        if external is None:
            problem = f"is {EXTERNAL!r}, which is asked over the bus"
            raise SpecError("team", "algorithm.use", problem, "use fleet run, or touchline coordinator")
        return AlgorithmTask(team, area, given, external(radio))
    make = algorithm_of(team.algorithm)
    first = made(make)
    if not is_distributed(first):
        return AlgorithmTask(team, area, given, CentralDecider(first))
    return AlgorithmTask(team, area, given, RobotDeciders(make, radio))
