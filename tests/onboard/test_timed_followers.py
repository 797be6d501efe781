"""Followers that keep the plan's time, on a robot of their own: legs, turns on the spot, stops, and being held up."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.onboard.rig import Run, chain, clothoid, reversing, start, trajectory
from tests.with_full import with_full
from touchline.onboard import tracking_state as tracking
from touchline.onboard.computer_state import ComputerState
from touchline.onboard.control import make_follower
from touchline.onboard.control.path_tracker import PathTracker
from touchline.onboard.filter_model import EAST
from touchline.onboard.interface import TICK_S
from touchline.onboard.trajectory.path_projection import MAX_AHEAD_M, MODE_PROFILE, track
from touchline.onboard.trajectory.timed_reference import Reference, by_profile, errors_against, run_on
from touchline.onboard.trajectory.trajectory import load_trajectory
from touchline.schemas.curves import PathTable
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.vehicles import Vehicle

TIMED = ["regularised", "nonlinear", "linear-scaled", "linear", "dynamic"]
EVERY = [*TIMED, "frenet"]
BENDS = chain((0.0, 4.0), *clothoid(0.6, 0.5, 6), (0.6, 3.0), *clothoid(0.6, 0.5, 6)[::-1], (0.0, 3.0))


def drive(run: Run) -> float:
    """To the end; returns how long it has driven [s]."""
    while run.onboard._traversal.job.aligning:
        run.tick()
    return TICK_S * run.until(TraversalStatus.DONE)


def planned_s(run: Run) -> float:
    return float(run.onboard._traversal.job.plan.total_time_s)


def along_m(run: Run) -> float:
    return float(run.onboard._traversal.job.driver.now[tracking.ALONG])


def off_path_m(run: Run, curves: list) -> float:
    """Largest true distance from the path."""
    table, worst = PathTable.from_curves(curves), 0.0
    while run.onboard.state == TraversalStatus.RUNNING:
        run.tick()
        x, y, heading, _ = table.at(run.onboard.status.arc_length_m)
        off = (run.rig.y - y) * math.cos(heading) - (run.rig.x - x) * math.sin(heading)
        worst = max(worst, abs(off))
    return worst


@pytest.mark.parametrize(
    "follower", with_full("nonlinear", "regularised", "dynamic", "frenet", full=("linear", "linear-scaled"))
)
def test_a_perfect_robot_stays_on_its_path(follower: str) -> None:
    assert off_path_m(start(trajectory(BENDS), follower), BENDS) < 4e-3


@pytest.mark.parametrize("follower", TIMED)
def test_it_arrives_at_the_planned_second(follower: str) -> None:
    run = start(reversing((1, [(0.0, 6.0)]), (-1, [(0.2, 3.0)]), (1, [(-0.2, 5.0)])), follower, noise="default", seed=2)
    assert drive(run) == pytest.approx(planned_s(run), abs=0.1)


@pytest.mark.parametrize("follower", EVERY)
def test_it_turns_in_place_between_legs(follower: str) -> None:
    run = start(reversing((1, [(0.0, 3.0)]), 2.0, (1, [(0.0, 3.0)]), -1.0, (-1, [(0.0, 2.0)])), follower)
    late_s = drive(run) - planned_s(run)
    assert abs(late_s) < 1.0
    off_rad = abs(math.remainder(run.rig.heading - 1.0, math.tau))
    slack = 4.0 if follower == "dynamic" else 1.0  # it turns its last millimetres into its heading
    assert off_rad < 0.025 * slack
    end = (3.0 + 3.0 * math.cos(2.0) - 2.0 * math.cos(1.0), 3.0 * math.sin(2.0) - 2.0 * math.sin(1.0))
    assert math.dist((run.rig.x, run.rig.y), end) < 0.02 * slack


def test_the_reference_waits_for_a_robot_that_is_held() -> None:
    """And goes on from rest, once that has come nearer."""
    computer = ComputerState.sized(2)()
    plan = load_trajectory(trajectory(chain((0.0, 12.0))), Vehicle())
    tracker = PathTracker(plan, Vehicle(), make_follower("regularised", Vehicle()), computer)
    pose, leg = computer.filter.states[0], computer.leg

    def ticks(count: int) -> None:
        for _ in range(count):
            track(computer.array, tracker.leg_arrays, 1, MODE_PROFILE)

    ticks(200)
    assert MAX_AHEAD_M < leg.reference_m < MAX_AHEAD_M + 0.02
    assert leg.now[tracking.ALONG] == leg.reference_m
    assert leg.speed_mps == 0.0
    waits_m = leg.reference_m
    ticks(100)
    assert leg.reference_m == waits_m
    pose[EAST] = 0.3
    ticks(30)
    assert 0.0 < leg.reference_m - waits_m < 0.5 * leg.accelerate_mps2 * 0.3**2 + 1e-9
    ticks(200)
    assert leg.reference_m == pytest.approx(waits_m + 0.3, abs=0.02)


SPEEDS = np.array([[0.0, 0.0], [1.0, 1.0], [3.007, 1.0], [3.4, 0.6], [3.4, 0.6], [4.0, 0.0], [4.0005, 0.0], [5.0, 1.0]])


@pytest.mark.parametrize("time_s", [0.01, 0.013, 0.37, 3.0])
def test_a_reference_is_where_the_profile_has_it_at_any_time(time_s: float) -> None:
    """By steps of any length it takes the time that the profile takes, and ends there with the rest left."""
    pace = SPEEDS[1:, 1] + SPEEDS[:-1, 1]
    times = np.concatenate(([0.0], np.cumsum(2.0 * np.diff(SPEEDS[:, 0]) / np.where(pace > 0.0, pace, np.inf))))
    at, t, left = Reference(0.0, 0.0, 0), 0.0, 0.0
    while left == 0.0:
        at, left = by_profile(SPEEDS, at, 4.8, time_s)
        t += time_s
        i = int(np.searchsorted(times, t, side="right")) - 1
        if left == 0.0:
            slope = (SPEEDS[i + 1, 1] - SPEEDS[i, 1]) / (times[i + 1] - times[i])
            u = t - times[i]
            assert at.arc_m == pytest.approx(SPEEDS[i, 0] + (SPEEDS[i, 1] + 0.5 * slope * u) * u, abs=1e-6)
            assert at.speed_mps == pytest.approx(SPEEDS[i, 1] + slope * u, abs=1e-4)
    assert at.arc_m == 4.8
    assert t - left == pytest.approx(times[6] + 2.0 * 0.7995 / math.sqrt(0.7995 / 0.9995), abs=1e-6)


def test_a_reference_at_rest_comes_up_to_the_profile_by_its_acceleration() -> None:
    at, left = run_on(SPEEDS, Reference(0.0, 2.0, 0), 4.8, 0.5, 1.0)
    assert (at.arc_m, at.speed_mps, left) == pytest.approx((2.25, 0.5, 0.0))
    for _ in range(3):
        at, _ = run_on(SPEEDS, at, 4.8, 0.5, 0.5)
    assert at.speed_mps == pytest.approx(float(np.sqrt(np.interp(at.arc_m, SPEEDS[:, 0], SPEEDS[:, 1] ** 2))))


def test_errors_are_of_the_reference_in_the_frame_of_the_robot() -> None:
    seen = errors_against((1.0, 2.0, math.pi / 2), (0.5, 4.0, -3.0))
    assert seen == pytest.approx((2.0, 0.5, math.tau - 3.0 - math.pi / 2))
