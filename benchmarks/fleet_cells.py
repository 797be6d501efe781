"""How long a team's update takes: Voronoi cells with centroids, buffered cells, and all of the coordinator's work."""

import math
import time
from collections.abc import Callable

import numpy as np

from touchline.services.fleet.cells import buffered_cells, stopping_segments
from touchline.services.fleet.coordinator import Coordinator, RobotPose, TeamSettings
from touchline.services.fleet.free_area import FreeArea
from touchline.services.fleet.lloyd import deployment
from touchline.services.fleet.tasks import Deploy

ROBOTS = (1, 10, 50, 200)
TIMES = 50
PLACE_M2 = 2.5


def main() -> None:
    """Print the median and the greatest time."""
    print(f"ms (median, most of {TIMES}), {PLACE_M2:g} m² a robot, all driving")
    print(f"{'robots':>6}  {'Voronoi, centroids':>20}  {'buffered cells':>20}  {'coordinator, in all':>20}")
    for robots in ROBOTS:
        print(f"{robots:6}  " + "  ".join(f"{_told(work):>20}" for work in _works(robots)))


def _works(robots: int) -> tuple[Callable[[], object], ...]:
    across = math.ceil(math.sqrt(robots))
    pitch = math.sqrt(PLACE_M2)
    area = FreeArea.of([(0.0, 0.0), (across * pitch, 0.0), (across * pitch, across * pitch), (0.0, across * pitch)])
    rng = np.random.default_rng(1)
    number = np.arange(robots)
    places = pitch * (np.column_stack((number % across, number // across)) + rng.uniform(0.35, 0.65, (robots, 2)))
    poses = np.column_stack((places, rng.uniform(-math.pi, math.pi, robots), rng.uniform(0.0, 0.5, robots)))
    segments = stopping_segments(poses, 0.5)
    told = {f"tb{k:03}": RobotPose(*row) for k, row in enumerate(poses.tolist())}
    coordinator = Coordinator(area, Deploy(area), TeamSettings(period_s=0.0))
    return (
        lambda: deployment(places, area),
        lambda: buffered_cells(segments, area),
        lambda: coordinator.update(time.perf_counter(), told),
    )


def _told(work: Callable[[], object]) -> str:
    work()
    took_ms = []
    for _ in range(TIMES):
        begin = time.perf_counter()
        work()
        took_ms.append(1e3 * (time.perf_counter() - begin))
    return f"{np.median(took_ms):.2f}, {max(took_ms):.2f}"
