"""From the poses of all robots to their cells and targets, every 0.4 s: for teams of which no message is lost.

Where messages may be lost or late, `hub.py` does the same by the protocol of `links.py`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from touchline.services.fleet.cells import ROBOT_RADIUS_M, BufferedCell, buffered_cells, stopping_segments
from touchline.services.fleet.deadlock import RightHand
from touchline.services.fleet.free_area import FreeArea
from touchline.services.fleet.tasks import TeamTask

Floats = NDArray[np.float64]

# An update is due this little (s) before its time, so that sums of ticks do not miss it by rounding.
_EARLY_S: Final = 1e-6


@dataclass(frozen=True)
class TeamSettings:
    """What all robots of a team have in common.

    Attributes:
        radius_m: r_s: the body's radius, three standard deviations of the estimate, the follower's error, and how far
            a robot drives in the time by which its pose is late.
        deceleration_mps2: How hard each brakes, at least.
        speed_max_mps: How fast each drives, at most.
        period_s: From update to update.
        lease_s: For how long a robot may drive on without being heard (see links.py): a round trip by the slowest
            messages and the loss of a few. The shorter, the sooner others may pass one that is silent.
    """

    radius_m: float = ROBOT_RADIUS_M
    deceleration_mps2: float = 0.5
    speed_max_mps: float = 0.5
    period_s: float = 0.4
    lease_s: float = 2.4

    @property
    def resting_s(self) -> float:
        """After this long without being heard a robot is at rest: the lease, and the time to brake."""
        return self.lease_s + self.speed_max_mps / self.deceleration_mps2


class RobotPose(NamedTuple):
    """Where a robot is and how fast it drives, in the map frame; a negative speed is backward."""

    x_m: float
    y_m: float
    heading_rad: float
    speed_mps: float


class RobotAim(NamedTuple):
    """What one robot is told until the next update: where it may be, and where it should go (m)."""

    cell: BufferedCell
    target_m: tuple[float, float]


class Aiming:
    """Targets within cells: the task's goals, as near as the cells let, by the right-hand rule."""

    def __init__(self, task: TeamTask) -> None:
        """For a task."""
        self._task, self._rule = task, RightHand()

    def aims(self, names: Sequence[str], places: Floats, cells: Sequence[BufferedCell]) -> dict[str, RobotAim]:
        """To be asked once an update.

        Args:
            names: Of n robots, in alphabetical order.
            places: (n, 2) where they are (m).
            cells: Where each may be.
        """
        rows = zip(names, places, self._task.goals(names, places), cells, strict=True)
        found = {}
        for name, place, goal, cell in rows:
            x, y = self._rule.target(name, place, goal, cell).tolist()
            found[name] = RobotAim(cell, (x, y))
        return found

    @property
    def stuck(self) -> frozenset[str]:
        """Whom the right-hand rule sends aside."""
        return self._rule.stuck


class Coordinator:
    """Divides the area anew every period; the result does not depend on the order in which robots are listed."""

    def __init__(self, area: FreeArea, task: TeamTask, settings: TeamSettings | None = None) -> None:
        """Nothing is divided yet."""
        self._area, self._settings = area, settings or TeamSettings()
        self._aiming = Aiming(task)
        self._due_s = -np.inf
        self._aims: dict[str, RobotAim] = {}

    def update(self, time_s: float, poses: Mapping[str, RobotPose]) -> Mapping[str, RobotAim]:
        """What each robot is told; between updates, the same as at the last.

        Args:
            time_s: Sim time.
            poses: Of all robots, by their names.

        Raises:
            SegmentsMeet: Two robots are about to run into each other, or one into a wall.
        """
        if time_s < self._due_s - _EARLY_S:
            return self._aims
        self._due_s = time_s + self._settings.period_s
        names = sorted(poses)
        rows = np.array([poses[name] for name in names], dtype=np.float64).reshape(-1, 4)
        segments = stopping_segments(rows, self._settings.deceleration_mps2)
        cells = buffered_cells(segments, self._area, self._settings.radius_m, names)
        self._aims = self._aiming.aims(names, np.ascontiguousarray(rows[:, :2]), cells)
        return self._aims

    @property
    def stuck(self) -> frozenset[str]:
        """Whom the right-hand rule sends aside."""
        return self._aiming.stuck
