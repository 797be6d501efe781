"""A thing that stands on the field, and a robot that is held before it as its protection would hold it."""

import math
from typing import NamedTuple

import shapely

from touchline.jobs.shared.timed_path import _poses
from touchline.jobs.shared.unfinished_lines import body_at
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Polygon
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.loaded_job import LoadedJob
from touchline.services.robot_sim.settling import RESTING_MPS

KEPT_M = 0.1
"""Distance from the thing that the body keeps."""
SEEN_M = 3.0
"""Distance from which the robot sees the thing."""


class Report(NamedTuple):
    """A stop before the thing."""

    since_tick: int
    moving: bool = False


class HeldRobot(Emulator):
    """An emulated robot that sees a thing, for as long as it stands there, and never drives into it.

    Attributes:
        closest_m: Least distance of the true body from the thing while that stood there.
    """

    def __init__(self, thing: Polygon, gone_s: float = math.inf) -> None:
        super().__init__(Vehicle(), Scenario(seed=5))
        self._thing, self._shape, self._gone_s = thing, shapely.Polygon(thing.corners), gone_s
        self._limit_m, self._since, self._known = math.inf, -1, False
        self.closest_m = math.inf

    def take(self, job: LoadedJob) -> float:
        """Find where on the path the body would be too near to the thing."""
        duration_s = super().take(job)
        arcs_m, poses = _poses(job.course.plan)
        near = [body_at(tuple(pose), self.vehicle).distance(self._shape) < KEPT_M for pose in poses]
        self._limit_m, self._since = float(arcs_m[max(near.index(True) - 1, 0)]) if any(near) else math.inf, -1
        if self._stands and math.isfinite(self._limit_m):
            self.authorize(self._limit_m)
        return duration_s

    @property
    def _stands(self) -> bool:
        return self.time_s < self._gone_s

    def blocked(self) -> Report | None:
        """The report of protection; the authority that stands for it is lifted when the thing has gone."""
        off_m = body_at(self.world.pose, self.vehicle).distance(self._shape)
        if self._stands:
            self.closest_m = min(self.closest_m, off_m)
        elif math.isfinite(self._limit_m):
            self._limit_m = math.inf
            self.authorize(math.inf)
        self._known = self._stands and (self._known or off_m < SEEN_M)
        if not (self.onboard.held and math.isfinite(self._limit_m)) or abs(self.world.state.speed_mps) > RESTING_MPS:
            self._since = -1
            return None
        self._since = self.tick_count if self._since < 0 else self._since
        return Report(self._since)

    def seen(self) -> list[Polygon]:
        """The thing, from when it was near until it has gone."""
        return [self._thing] if self._known else []
