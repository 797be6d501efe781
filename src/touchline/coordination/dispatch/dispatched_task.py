"""Task of a team whose robots do what a dispatcher assigns to them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from touchline.coordination.algorithms.algorithm_task import AlgorithmTask
from touchline.coordination.coverage import TeamCoverage
from touchline.coordination.density import Density
from touchline.coordination.dispatch.dispatcher import TaskDispatcher
from touchline.coordination.dispatch.route_planning import RobotFigures
from touchline.coordination.free_area import FreeArea
from touchline.coordination.lloyd import EVEN
from touchline.coordination.tasks import TeamTask
from touchline.schemas.task_requests import DispatchTask
from touchline.schemas.team import TeamScenario

Floats = NDArray[np.float64]

_CRUISE: Final = 0.8
"""Mean speed on a way among others, a share of the largest."""
_DRIVING: Final = 1.5
"""Power while driving, a share of that while standing (assumed)."""


class DispatchedTask:
    """Task of a team with a dispatcher, as of `TeamTask`.

    Args:
        spec: The task.
        team: The team.
        area: The area.
        places: Place of each robot, by name (m, map frame).

    Attributes:
        dispatcher: The dispatcher.
        last: Where each robot is to be now (m, map frame).
    """

    ends_on_arrival = True
    density: Density = EVEN
    coverage: TeamCoverage | None = None

    def __init__(
        self, spec: DispatchTask, team: TeamScenario, area: FreeArea, places: Mapping[str, tuple[float, float]]
    ) -> None:
        body = team.vehicle.body
        figures = RobotFigures(
            speed_mps=_CRUISE * team.vehicle.drive.transit_speed_mps,
            driving_w=_DRIVING * body.idle_power_w,
            standing_w=body.idle_power_w,
            battery_wh=body.battery_wh,
        )
        homes = {name: complex(*place) for name, place in places.items()}
        self.dispatcher = TaskDispatcher(spec, area, homes, figures, team.radius_m)
        self.last: dict[str, tuple[float, float]] = dict(places)
        self._round_walls = not team.by_plans
        self._now_s, self._charges, self._silent = 0.0, dict[str, float](), frozenset[str]()

    def observe(self, now_s: float, charges: Mapping[str, float], silent: Collection[str]) -> None:
        """Take what the next goals are to consider.

        Args:
            now_s: Time since the team began.
            charges: Charge of each robot that is known, a share of the whole, by name.
            silent: Robots that are only obstacles.
        """
        self._now_s, self._charges, self._silent = now_s, dict(charges), frozenset(silent)

    def goals(self, names: Sequence[str], states: Floats) -> Floats:
        """Return goals, as of `TeamTask`; by cells, which know no ways, a place on the way that is seen."""
        places = {name: complex(x, y) for name, (x, y) in zip(names, states[:, :2].tolist(), strict=True)}
        goals = self.dispatcher.update(self._now_s, places, self._charges, self._silent)
        self.last = {name: (goals[name].real, goals[name].imag) for name in names}
        if self._round_walls:
            goals = {name: self.dispatcher.table.aim(places[name], goals[name]) for name in names}
        return np.array([(goals[name].real, goals[name].imag) for name in names]).reshape(-1, 2)


def dispatched(task: TeamTask | None) -> DispatchedTask | None:
    """Return a team's task if it is to be dispatched, also by an algorithm; None if it is another."""
    given = task.given if isinstance(task, AlgorithmTask) else task
    return given if isinstance(given, DispatchedTask) else None
