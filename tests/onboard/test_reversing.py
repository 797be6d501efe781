"""Legs driven backward, cusps and turns on the spot: taken, driven, paused in, and never painted."""

from __future__ import annotations

import math

import pytest

from tests.onboard.rig import reversing, start
from touchline.onboard.trajectory.path import BACKWARD, FORWARD, SPIN
from touchline.onboard.trajectory.trajectory import load_trajectory
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import Trajectory, TraversalStatus, VelocityProfile
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.paint.targets import start_pose

PAUSED, DONE = TraversalStatus.PAUSED, TraversalStatus.DONE
VEHICLE = Vehicle()

# Out, back round a bend, out again; and a turn on the spot by a quarter to the left between two straights.
THREE_POINT = reversing((1, [(0.0, 3.0)]), (-1, [(0.5, 2.0), (0.0, 1.0)]), (1, [(0.0, 4.0)]))
QUARTER = reversing((1, [(0.0, 3.0)]), math.pi / 2, (1, [(0.0, 4.0)]), sprays=((5.0, 6.5),))
LEADING = reversing(-1.0, (-1, [(0.0, 2.0)]), 3.0, (1, [(0.0, 2.0)]), 0.5)


def end_of(plan: Trajectory) -> tuple[float, float, float]:
    loaded = load_trajectory(plan, VEHICLE)
    leg = loaded.legs[-1]
    row = loaded.path[leg.last - 1]
    heading = float(row[2] + row[3] * row[4] + leg.turn_rad)
    half = 0.5 * row[3] * row[4]
    chord = row[6] * row[4] * math.sin(half) / half if half else row[6] * row[4]
    return float(row[0] + chord * math.cos(row[2] + half)), float(row[1] + chord * math.sin(row[2] + half)), heading


def test_legs_of_a_path() -> None:
    legs = load_trajectory(THREE_POINT, VEHICLE).legs
    assert [leg.sense for leg in legs] == [FORWARD, BACKWARD, FORWARD]
    assert [(leg.start_m, leg.end_m) for leg in legs] == [(0.0, 3.0), (3.0, 6.0), (6.0, 10.0)]
    legs = load_trajectory(LEADING, VEHICLE).legs
    assert [leg.sense for leg in legs] == [SPIN, BACKWARD, SPIN, FORWARD, SPIN]
    assert [leg.heading_rad for leg in legs] == pytest.approx([0.0, -1.0, -1.0, 2.0, 2.0])


def test_time_counts_the_turns() -> None:
    loaded = load_trajectory(QUARTER, VEHICLE)
    # 1.57 rad at up to 2 rad/s, as fast as the wheels may speed up
    gain = VEHICLE.drive.max_acceleration_mps2 / VEHICLE.drive.half_track_m
    turning = math.pi / 2 / 2.0 + 2.0 / gain
    assert loaded.total_time_s == pytest.approx(4.0 + 5.0 + turning)
    assert loaded.time_at(3.0, 1) == pytest.approx(4.0)
    assert loaded.time_at(3.0, 2) == pytest.approx(4.0 + turning)


@pytest.mark.parametrize(("follower", "noise"), [("mpc", "default"), ("pure-pursuit", "none")])
@pytest.mark.parametrize("plan", [THREE_POINT, QUARTER], ids=["cusps", "quarter"])
def test_drives_to_the_end(plan: Trajectory, follower: str, noise: str) -> None:
    run = start(plan, follower, noise, seed=2)
    while run.onboard.state == TraversalStatus.RUNNING:
        run.tick()
    assert run.onboard.state == DONE, run.onboard.status
    run.ticks(100)
    x, y, heading = end_of(plan)
    assert math.dist((run.rig.x, run.rig.y), (x, y)) < 0.05
    assert abs(math.remainder(run.rig.heading - heading, math.tau)) < 0.03
    assert run.onboard.status.elapsed_s < load_trajectory(plan, VEHICLE).total_time_s + 2.5
    assert run.onboard.status.follower_fallbacks == 0


def test_follows_a_path_of_turns_and_reversals_closely() -> None:
    run = start(LEADING)
    worst = 0.0
    while run.onboard.state == TraversalStatus.RUNNING:
        run.tick()
        if run.onboard.status.segment_id in ("s1", "s3"):
            worst = max(worst, abs(run.onboard.lateral_error_m))
    assert run.onboard.state == DONE
    assert worst < 0.004
    run.ticks(50)
    x, y, heading = end_of(LEADING)
    assert math.dist((run.rig.x, run.rig.y), (x, y)) < 0.015
    assert abs(math.remainder(run.rig.heading - heading, math.tau)) < 0.01


@pytest.mark.parametrize("segment", ["s1", "s2"])
def test_pause_on_the_way_back_and_in_a_turn(segment: str) -> None:
    plan = reversing((1, [(0.0, 2.0)]), (-1, [(0.0, 2.0)]), 1.5, (1, [(0.0, 3.0)]))
    run = start(plan)
    while run.onboard.status.segment_id != segment:
        run.tick()
    run.ticks(60)
    run.onboard.pause()
    run.ticks(200)
    assert abs(run.rig.speed) < 1e-3 and abs(run.rig.yaw_rate) < 1e-3
    assert run.onboard.status.segment_id == segment
    run.onboard.resume()
    run.until(DONE)
    run.ticks(50)
    x, y, _ = end_of(plan)
    assert math.dist((run.rig.x, run.rig.y), (x, y)) < 0.03


def test_paint_after_a_turn_is_where_it_should_be() -> None:
    run = start(QUARTER)
    opened: list[float] = []
    while run.onboard.state == TraversalStatus.RUNNING:
        before = run.command.valve
        if run.tick().valve and not before:
            opened.append(run.rig.y)
        if run.command.valve:
            assert run.onboard.status.segment_id == "s2"
    assert opened == pytest.approx([2.0], abs=0.011)


def faster_at_the_cusp() -> Trajectory:
    entries = [
        p.model_copy(update={"velocity": p.velocity.model_copy(update={"value": 0.5})})
        if p.velocity.value == 0.0
        else p
        for p in THREE_POINT.velocity_profile.parameters
    ]
    return THREE_POINT.model_copy(update={"velocity_profile": VelocityProfile(parameters=tuple(entries))})


def without_angular() -> Trajectory:
    entries = tuple(p for p in QUARTER.velocity_profile.parameters if p.velocity.type.value != 2)
    return QUARTER.model_copy(update={"velocity_profile": VelocityProfile(parameters=entries)})


REFUSED = {
    "cusp at speed": (faster_at_the_cusp(), "changes direction at 0.50 m/s"),
    "no rate": (without_angular(), 'segment 1 ("s1") turns on the spot, but the velocity profile has no ANGULAR'),
    "too fast a turn": (reversing((1, [(0.0, 2.0)]), 1.0, (1, [(0.0, 2.0)]), rate=9.0), "at 9.00 rad/s needs"),
    "only a turn": (reversing(1.0), "only turns on the spot"),
    "endless turn": (reversing((1, [(0.0, 2.0)]), 30.0), "more than twice round"),
    "painted backward": (
        reversing((1, [(0.0, 3.0)]), (-1, [(0.0, 3.0)]), sprays=((3.5, 4.5),)),
        "sprays while driving backward, from segment 1",
    ),
}


@pytest.mark.parametrize(("plan", "reason"), REFUSED.values(), ids=REFUSED.keys())
def test_refused_with_a_reason(plan: Trajectory, reason: str) -> None:
    with pytest.raises(CommandRefused) as refusal:
        load_trajectory(plan, VEHICLE)
    assert reason in str(refusal.value)


def test_start_pose_of_a_path_that_begins_with_a_turn() -> None:
    assert math.remainder(start_pose(LEADING)[2], math.tau) == pytest.approx(0.0)
