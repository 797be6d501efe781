"""Time that a team's update takes: Voronoi cells with centroids, buffered cells, and a full exchange with the hub.

`python -m benchmarks fleet_cells`; `most` is the size of the largest team, `times` how often each update is timed.
"""

import math
import time
from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from benchmarks._all_at_once import buffered_cells, stopping_segments
from benchmarks._settings import Small
from touchline.core.arcs import unit
from touchline.fleet.free_area import FreeArea
from touchline.fleet.hub import Hub
from touchline.fleet.lloyd import deployment
from touchline.fleet.tasks import Deploy
from touchline.onboard.control.cell_steering import HEADING, SPEED, SteeringLimits, X, Y, steer_in_cell
from touchline.onboard.executive.cell_keeper import CellKeeper, Segment
from touchline.schemas.messages import Guidance, Whereabouts
from touchline.schemas.onboard import TeamLimits

Floats = NDArray[np.float64]

ROBOTS: Final = (1, 10, 50, 200)
PLACE_M2: Final = 2.5
PERIOD_S, TICKS = 0.4, 8
LIMITS: Final = SteeringLimits(0.5, 0.5, math.inf, 2.0, 0.01, 0.02)
SMALL: Final = Small(
    {"most": 10, "times": 2},
    (
        "ms (median, most of #), # m² a robot; with the hub, all driving",
        "robots Voronoi, centroids buffered cells exchange with hub",
        *(f"{robots} #, # #, # #, #" for robots in (1, 10)),
    ),
)


class _Team:
    """Robots that spread from a corner, with the messages between them and the hub."""

    def __init__(self, area: FreeArea, robots: int) -> None:
        across = math.ceil(math.sqrt(robots))
        number = np.arange(robots)
        self._motions = np.zeros((robots, 4))
        self._motions[:, :2] = 0.3 + 0.48 * np.column_stack((number % across, number // across))
        self._keepers = {f"tb{k:03}": CellKeeper(TeamLimits(doubt_m=0.0)) for k in range(robots)}
        self._now_s = 0.0
        self._said, self._told = self._say(), dict[str, Guidance]()
        self._hub = Hub(area, Deploy(area), self._said)

    def exchange(self) -> None:
        """Do the hub's work of one period."""
        for name, message in self._said.items():
            self._hub.receive(name, message, self._now_s)
        self._hub.update(self._now_s)
        self._told = self._hub.guidance()

    def drive(self) -> None:
        """Do the robots' work until the next period."""
        tick_s = PERIOD_S / TICKS
        for motion, segment, (name, keeper) in zip(self._motions, self._segments(), self._keepers.items(), strict=True):
            keeper.receive(self._told[name], segment)
            for _ in range(TICKS if len(keeper.half_planes) else 0):
                speed, rate, _ = steer_in_cell(motion, False, keeper.half_planes, keeper.target_m, LIMITS, tick_s)
                step = unit(motion[HEADING] + 0.5 * rate * tick_s) * (0.5 * (motion[SPEED] + speed) * tick_s)
                motion[:] = motion[X] + step.real, motion[Y] + step.imag, motion[HEADING] + rate * tick_s, speed
        self._now_s += PERIOD_S
        self._said = self._say()

    def _segments(self) -> list[Segment]:
        rows = stopping_segments(self._motions, LIMITS.acceleration_mps2).tolist()
        return [(complex(x, y), complex(stop_x, stop_y)) for x, y, stop_x, stop_y in rows]

    def _say(self) -> dict[str, Whereabouts]:
        rows = zip(self._keepers.items(), self._segments(), strict=True)
        return {name: keeper.report(self._now_s, segment) for (name, keeper), segment in rows}


def main(most: int = 200, times: int = 50) -> None:
    """Print the median and the greatest time."""
    print(f"ms (median, most of {times}), {PLACE_M2:g} m² a robot; with the hub, all driving")
    print(f"{'robots':>6}  {'Voronoi, centroids':>20}  {'buffered cells':>20}  {'exchange with hub':>20}")
    for robots in (robots for robots in ROBOTS if robots <= most):
        print(f"{robots:6}  " + "  ".join(f"{text:>20}" for text in _columns(robots, times)))


def _columns(robots: int, times: int) -> tuple[str, str, str]:
    across = math.ceil(math.sqrt(robots))
    pitch = math.sqrt(PLACE_M2)
    area = FreeArea.of([(0.0, 0.0), (across * pitch, 0.0), (across * pitch, across * pitch), (0.0, across * pitch)])
    rng = np.random.default_rng(1)
    number = np.arange(robots)
    places = pitch * (np.column_stack((number % across, number // across)) + rng.uniform(0.35, 0.65, (robots, 2)))
    poses = np.column_stack((places, rng.uniform(-math.pi, math.pi, robots), rng.uniform(0.0, 0.5, robots)))
    segments = stopping_segments(poses, 0.5)
    team = _Team(area, robots)
    return (
        _timed(times, lambda: deployment(places, area)),
        _timed(times, lambda: buffered_cells(segments, area)),
        _timed(times, team.exchange, team.drive),
    )


def _timed(times: int, work: Callable[[], object], between: Callable[[], object] = lambda: None) -> str:
    """Format median and maximum, in ms, without the work in between."""
    took_ms = []
    for _ in range(times + 1):
        begin = time.perf_counter()
        work()
        took_ms.append(1e3 * (time.perf_counter() - begin))
        between()
    compiled_ms = took_ms[1:]
    return f"{np.median(compiled_ms):.2f}, {max(compiled_ms):.2f}"
