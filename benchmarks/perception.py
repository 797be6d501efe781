"""Tracks of people who walk round a robot, against the truth, and the time that a scan takes.

`python -m benchmarks perception`: `people` are followed one by one for `seconds` each by either lidar.
"""

from __future__ import annotations

import math
import time
from typing import NamedTuple

import numpy as np

from benchmarks._lidar_scene import Floats, Scene, Seeing, legs, standing
from benchmarks._settings import Small
from benchmarks.estimator import Check
from touchline.onboard.perception.tracks import TrackedThing
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.lidar_spec import LidarSpec

LIDARS = {
    "0.5 deg, 10 Hz": LidarSpec(name="front", sigma_m=0.03, systematic_m=0.0),
    "1 deg, 5 Hz (LDS-01)": LidarSpec(
        name="front", rate_hz=5, scan_s=0.2, beams=360, step_rad=math.radians(1.0), min_m=0.12, max_m=3.5, dark_m=3.5
    ),
}
DROPOUT = 0.01
POSE_SIGMA = (0.01, math.radians(0.1))
WARM_UP_S = 1.0
SMALL = Small(
    {"people": 1, "seconds": 3, "scans": 20},
    (*(f"{name}: # people" for name in LIDARS), "a scan of 720 beams with 20 things: # us"),
)
_LOST_M = 0.7
_EDGE_M = 0.5
"""Distance from the lidar's longest range from which on a person is partly out of it, and not counted."""
_NEAREST_M = 1.0
_ROUND_RADPS = 2.0


class Walker:
    """A person who walks at random within reach: in bends, at times round a corner.

    Args:
        seed: Seed of the walk.
        farthest_m: Largest distance from the origin.
        seconds: Duration.
        corners_hz: Right angles a second.
    """

    def __init__(self, seed: int, farthest_m: float, seconds: float, corners_hz: float) -> None:
        rng, step_s = np.random.default_rng(seed), 0.02
        angle, heading = rng.uniform(0.0, math.tau), rng.uniform(0.0, math.tau)
        place = rng.uniform(1.5, farthest_m) * np.array([math.cos(angle), math.sin(angle)])
        speed, turning, phase, rows = rng.uniform(0.6, 1.5), 0.0, rng.uniform(0.0, math.tau), []
        for _ in range(int(seconds / step_s) + 100):
            turning += (-turning / 1.0) * step_s + 0.5 * math.sqrt(step_s) * rng.normal()
            heading += turning * step_s
            if rng.random() < corners_hz * step_s:
                heading += rng.choice((-0.5, 0.5)) * math.pi
            distance, ahead = float(np.hypot(*place)), np.array([math.cos(heading), math.sin(heading)])
            back = distance > farthest_m and place @ ahead > 0.0
            away = distance < _NEAREST_M and place @ ahead < 0.0
            heading += _ROUND_RADPS * step_s if back or away else 0.0
            velocity = speed * np.array([math.cos(heading), math.sin(heading)])
            place = place + step_s * velocity
            phase += math.tau * speed / 1.4 * step_s
            rows.append((*place, heading, phase, *velocity))
        self._rows, self._step_s = np.array(rows), step_s

    def at(self, time_s: float) -> Floats:
        """Return place, heading, phase of the step, and velocity, (6,)."""
        row: Floats = self._rows[min(int(time_s / self._step_s), len(self._rows) - 1)]
        return row

    def scene_at(self, time_s: float) -> Scene:
        """Return its legs."""
        x, y, heading, phase, _, _ = self.at(time_s).tolist()
        return Scene(legs(x, y, heading, phase))


class Followed(NamedTuple):
    """Errors of the tracks of people, one entry a scan in which a person had one.

    Attributes:
        off_m: Distance from the truth.
        speed_off_mps: Difference of the velocities.
        inside: True within 3 σ of the place, of 2 degrees of freedom.
        lost: Number of times that a person got another track.
        moving: True if it counted as moving.
    """

    off_m: Floats
    speed_off_mps: Floats
    inside: Floats
    lost: int
    moving: Floats


def _nearest(tracks: list[TrackedThing], x: float, y: float) -> TrackedThing | None:
    near = min(tracks, key=lambda each: math.hypot(each.x_m - x, each.y_m - y), default=None)
    return near if near is not None and math.hypot(near.x_m - x, near.y_m - y) < _LOST_M else None


def follow_people(lidar: LidarSpec, people: int, seconds: float, seed: int = 1) -> Followed:
    """Follow walking people, one at a time.

    Args:
        lidar: The robot's lidar.
        people: Number of people.
        seconds: Time for which each is followed.
        seed: Seed of the first.
    """
    rows, lost = [], 0
    farthest_m = min(9.0, lidar.dark_m - 1.2)
    for who in range(seed, seed + people):
        walker = Walker(who, farthest_m, seconds + 2.0, 0.01 * lidar.rate_hz)
        seeing = Seeing(Vehicle(sensors=(lidar,)), standing(), walker.scene_at, who)
        seeing.dropout, seeing.pose_sigma = DROPOUT, POSE_SIGMA
        number = 0
        for _ in range(int(seconds * lidar.rate_hz)):
            seeing.scan()
            x, y, _, _, vx, vy = walker.at(seeing.time_s).tolist()
            track = _nearest(seeing.perception.tracks, x, y)
            if math.hypot(x, y) > lidar.dark_m - _EDGE_M:
                number = 0
                continue
            if seeing.scans < WARM_UP_S * lidar.rate_hz or track is None:
                continue
            lost += number not in (0, track.number)
            number = track.number
            off_m = math.hypot(track.x_m - x, track.y_m - y)
            speed_off = math.hypot(track.vx_mps - vx, track.vy_mps - vy)
            rows.append((off_m, speed_off, off_m < 3.0 * track.place_sigma_m, track.moving))
    columns = np.array(rows).T
    return Followed(columns[0], columns[1], columns[2], lost, columns[3])


def scan_us(scans: int) -> float:
    """Return the median CPU time of a scan with ten people, ten posts, rain, and 20 outlines that are known [µs]."""
    angles = np.arange(20) * math.tau / 20.0
    places = np.stack((np.cos(angles), np.sin(angles)), 1) * np.linspace(2.0, 8.0, 20)[:, None]
    people = [
        legs(x, y, angle, angle) for (x, y), angle in zip(places[:10].tolist(), angles[:10].tolist(), strict=True)
    ]
    scene = Scene(np.vstack((*people, np.column_stack((places[10:], np.full(10, 0.06))))))
    seeing = Seeing(Vehicle(sensors=(LidarSpec(name="front"),)), standing(), lambda _: scene)
    seeing.perception.restart([[(x, y), (x + 1.0, y), (x + 1.0, y + 0.2)] for x, y in (1.3 * places).tolist()])
    seeing.rain, seeing.dropout, seeing.pose_sigma = 0.001, DROPOUT, POSE_SIGMA
    times = []
    for _ in range(scans):
        sample = seeing.sample()
        begun_s = time.thread_time()
        seeing.perception.take(sample, seeing.estimator)
        times.append(time.thread_time() - begun_s)
    return 1e6 * float(np.median(times[len(times) // 4 :]))


def main(people: int = 60, seconds: int = 20, scans: int = 400) -> None:
    """Print every figure with its bounds."""
    found: list[Check] = []
    for name, lidar in LIDARS.items():
        followed = follow_people(lidar, people, seconds)
        scale = people * seconds / 20.0
        print(f"{name}: {people} people for {seconds} s; {100.0 * followed.moving.mean():.1f} % moving")
        checks = (
            Check("place within 3 sigma", 100.0 * followed.inside.mean(), 98.9, 100.0, " %"),
            Check("place, 95 %", np.percentile(followed.off_m, 95.0), 0.0, 0.15, " m"),
            Check("velocity, rms", math.sqrt((followed.speed_off_mps**2).mean()), 0.0, 0.4, " m/s"),
            Check("losses in 20 s", followed.lost / scale, 0.0, 0.1),
        )
        for check in checks:
            print(check)
        found += checks
    spent_us = scan_us(scans)
    print(f"\na scan of 720 beams with 20 things: {spent_us:.0f} us")
    print(f"{sum(check.holds for check in found)} of {len(found)} hold")
