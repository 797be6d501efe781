"""Emulated lidar: its ranges against brute force, the time of a scan, and what a robot costs that has one.

`python -m benchmarks lidar`: `poses` are compared beam by beam; `scans` are timed; `template` is driven `repeats` times
without and with the lidar of `examples/vehicles/marker-lidar.json`, of which the best counts.
"""

from __future__ import annotations

import math
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks._settings import Small
from benchmarks.estimator import Check
from touchline.core.jit import kernel
from touchline.jobs.single.simulation import Job, simulate
from touchline.schemas.catalogue import load_template, load_vehicle
from touchline.schemas.lidar_truth import LidarTruth
from touchline.schemas.messages import PlanOptions
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.lidar_spec import LidarSpec
from touchline.services.robot_sim.sensors.auxiliary_truth import Draw
from touchline.services.robot_sim.sensors.lidar_in_world import LidarInWorld
from touchline.services.robot_sim.sensors.lidar_scan import LidarFigures, ScanArrays, see
from touchline.services.robot_sim.sensors.rays import range_to_edge
from touchline.services.robot_sim.world.objects.solids import DARK, HEIGHT, SOLID_COLUMNS, X1, X2, Y1, Y2, solid_grid
from touchline.services.robot_sim.world.objects.surroundings import Surroundings
from touchline.services.robot_sim.world.objects.things import POSES

Floats = NDArray[np.float64]

SPEC = LidarSpec(name="front", beams=541, first_rad=-0.75 * math.pi, step_rad=math.radians(0.5), x_m=0.4)
VEHICLES = ("turf-tank-two", Path("examples/vehicles/marker-lidar.json"))
SEGMENTS = ((1000, 50.0), (5000, 100.0))
"""Numbers of segments, and the most time of a scan among them [µs]."""
HALF_M = 40.0
TICK = 1000
SMALL = Small(
    {"poses": 3, "scans": 20, "template": "study-square", "repeats": 1},
    (
        "# beams that differ from brute force, of # poses x # beams",
        "# segments: a scan # us at most",
        "study-square: # s of CPU without a lidar, # s with one: # % more",
    ),
)


@kernel
def _by_brute_force(lidar: LidarFigures, scan: ScanArrays, solids: Floats, ranges: Floats) -> None:
    """Fill in the ranges (beams,) of aimed beams by a test of each against every edge."""
    for beam in range(len(ranges)):
        nearest, dark = math.inf, 0.0
        for i in range(len(solids)):
            solid = solids[i]
            met = range_to_edge(scan.rays[beam], solid[X1], solid[Y1], solid[X2], solid[Y2])
            if met < nearest and lidar.height_m - scan.drop[beam] * met <= solid[HEIGHT]:
                nearest, dark = met, solid[DARK]
        ranges[beam] = nearest if nearest <= (lidar.dark_m if dark > 0.0 else lidar.max_m) else math.inf


def boxes(rng: np.random.Generator, segments: int) -> Floats:
    """Return the edges (`segments`, SOLID_COLUMNS) of turned boxes in a square round the origin, four of each."""
    rows = []
    for _ in range(segments // 4):
        place, (half_x, half_y) = rng.uniform(-HALF_M, HALF_M, 2), rng.uniform(0.1, 1.0, 2)
        turn = np.exp(1j * rng.uniform(0.0, math.tau))
        shape = turn * np.array(
            [-half_x - 1j * half_y, half_x - 1j * half_y, half_x + 1j * half_y, -half_x + 1j * half_y]
        )
        ends = np.column_stack((shape.real, shape.imag)) + place
        for a, b in zip(ends, np.roll(ends, -1, 0), strict=True):
            row = np.zeros(SOLID_COLUMNS)
            row[[X1, Y1, X2, Y2]], row[HEIGHT], row[DARK] = (*a, *b), 1.0, float(rng.random() < 0.3)
            rows.append(row)
    return np.array(rows)


class _Scanned:
    """A lidar among boxes, moved about."""

    def __init__(self, segments: int, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.solids = boxes(self.rng, segments)
        self.lidar = LidarInWorld(SPEC, LidarTruth(), Draw(1, 1 << 16, silent=True))
        around = Surroundings(Vehicle(), Scenario(), 0.0)
        around.things = self.things = around.things._replace(grid=solid_grid(self.solids.tolist()))
        self.lidar.surroundings = around

    def move(self) -> None:
        """Take another pose and twist."""
        pose, twist = self.rng.uniform((-30.0, -30.0, -3.0), (30.0, 30.0, 3.0)), self.rng.uniform(-1.5, 1.5, 3)
        for back in range(POSES):
            self.things.trail[(TICK - back) % POSES] = pose - twist * 0.01 * back

    def scan(self) -> None:
        """Compute the true ranges."""
        see(self.lidar._figures, self.lidar._arrays, self.things, TICK)


def differing_beams(poses: int, segments: int = 1000) -> int:
    """Return the number of beams, over random poses, whose range is not to the bit that of brute force."""
    scanned, wanted, found = _Scanned(segments, 1), np.zeros(SPEC.beams), 0
    for _ in range(poses):
        scanned.move()
        scanned.scan()
        _by_brute_force(scanned.lidar._figures, scanned.lidar._arrays, scanned.solids, wanted)
        found += int((np.abs(scanned.lidar._arrays.ranges) != wanted).sum())
    return found


def scan_us(segments: int, scans: int) -> float:
    """Return the median time of a scan among so many segments, at random poses [µs]."""
    scanned, times = _Scanned(segments, 2), []
    scanned.scan()
    for _ in range(scans):
        scanned.move()
        begun_s = time.perf_counter()
        scanned.scan()
        times.append(time.perf_counter() - begun_s)
    return 1e6 * float(np.median(times))


def driving_s(template: str, repeats: int) -> tuple[float, float]:
    """Return the CPU time of a drive without a lidar and with one [s], each the least of several."""
    jobs = [Job.prepare(load_template(template), PlanOptions(), load_vehicle(name)) for name in VEHICLES]
    least = [math.inf, math.inf]
    for _ in range(repeats):
        for n, job in enumerate(jobs):
            begun_s = time.process_time()
            simulate(job, Scenario(), OnboardConfig())
            least[n] = min(least[n], time.process_time() - begun_s)
    return least[0], least[1]


def main(poses: int = 1000, scans: int = 1000, template: str = "tennis", repeats: int = 5) -> None:
    """Print every figure with its bound."""
    differ = differing_beams(poses)
    print(f"{differ} beams that differ from brute force, of {poses} poses x {SPEC.beams} beams")
    for segments, most_us in SEGMENTS:
        print(Check(f"{segments} segments: a scan", scan_us(segments, scans), 0.0, most_us, " us"))
    without_s, with_s = driving_s(template, repeats)
    more = 100.0 * (with_s / without_s - 1.0)
    print(f"{template}: {without_s:.3f} s of CPU without a lidar, {with_s:.3f} s with one: {more:.0f} % more")
