"""Perception as a part of the robot's computer: which samples it takes, when it forgets, and what is published."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from benchmarks._lidar_scene import Seeing, box, standing, still
from tests.onboard.rig import Rig
from touchline.onboard import Onboard
from touchline.onboard.interface import TICKS_PER_S, AuxiliarySample
from touchline.onboard.warm_up_drive import straight
from touchline.schemas import messages as m
from touchline.schemas.cdr import decode
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.lidar_spec import LidarSpec
from touchline.services.robot_sim.packing import obstacles

LIDAR = LidarSpec(name="front")
VEHICLE = Vehicle(sensors=(LIDAR,))
BENCH = [(2.0, -0.5), (2.4, -0.5), (2.4, 0.5), (2.0, 0.5)]


def test_a_robot_without_a_lidar_has_no_perception() -> None:
    assert Onboard(Vehicle(), OnboardConfig()).perception is None


def test_scans_go_to_perception_and_a_missing_obstacle_is_told_once() -> None:
    onboard, rig = Onboard(VEHICLE, OnboardConfig()), Rig(VEHICLE)
    onboard.take(onboard.prepare(straight(VEHICLE), obstacles=[BENCH]))
    assert onboard.perception is not None
    scan, told = (math.inf,) * 200 + (3.0,) * 320 + (math.inf,) * 200, []
    for tick in range(1, 8 * TICKS_PER_S):
        onboard.step(rig.step())
        if tick % 10 == 0:
            onboard.take_samples(
                [AuxiliarySample("front", tick / TICKS_PER_S, scan), AuxiliarySample("other", 0.0, ())]
            )
        told += [event.text for event in onboard.take_events() if event.code == "obstacle-missing"]
    assert onboard.perception.hits is not None
    assert told == ["the plan's obstacle at (2.2, 0.0) m is not there"]
    assert onboard.perception.too_late < 10  # until the estimator has started
    onboard.abort()
    for _ in range(3 * TICKS_PER_S):
        onboard.step(rig.step())
    onboard.reset()
    onboard.take(onboard.prepare(straight(VEHICLE)))
    assert onboard.perception.hits is None  # the robot may have been carried elsewhere
    assert onboard.perception.known.outlines == []


def test_tracks_and_known_outlines_are_packed() -> None:
    walls = np.vstack((box(2.0, -0.5, 0.4, 1.0), box(2.0, 2.0, 0.4, 1.0)))
    seeing = Seeing(VEHICLE, standing(), still(walls=walls))
    seeing.perception.restart([BENCH])
    for _ in range(4):
        seeing.scan()
    topic, payload = obstacles(110, seeing.perception)
    unknown, known = decode(m.Obstacles, payload).obstacles
    assert topic.name == "obstacles"
    assert (unknown.kind, unknown.known, unknown.moving) == ("thing", False, False)
    assert unknown.y_m == pytest.approx(2.4, abs=0.3)
    assert len(unknown.outline_x_m) == len(unknown.outline_y_m) > 3
    assert (known.id, known.known, known.missing) == (0, True, False)
    assert known.outline_x_m.tolist() == [x for x, _ in BENCH]
    assert known.last_seen.sec + 1e-9 * known.last_seen.nanosec == pytest.approx(seeing.time_s)


def test_a_lidar_whose_oldest_beam_the_computer_could_not_place_is_refused() -> None:
    with pytest.raises(ValidationError, match=r"scan_s \+ latency_s must be at most 0.6 s"):
        LidarSpec(name="front", rate_hz=1, scan_s=0.5, latency_s=0.2)
