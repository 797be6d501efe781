"""The robot's belief of its paint: by its valve and its own progress, nothing twice."""

from __future__ import annotations

import pytest

from tests.onboard.rig import Run, chain, clothoid, start, trajectory
from touchline.onboard.computer_state import ComputerState
from touchline.onboard.executive.painted import Painted
from touchline.onboard.executive.sprayer import JOINT_OVERLAP_M, Sprayer
from touchline.onboard.interface import Checkpoint
from touchline.onboard.trajectory.trajectory import load_trajectory
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.vehicles import Vehicle

PAUSED, DONE = TraversalStatus.PAUSED, TraversalStatus.DONE
VEHICLE = Vehicle()
OFF_M, ON_M = VEHICLE.tool.valve_off_delay_s, VEHICLE.tool.valve_on_delay_s  # at 1 m/s

#: Two lines of 3 m and 2 m that go over into each other, and one of 2 m; the valve is opened early by its delay.
LINES = trajectory(
    chain((0.0, 5.0), (0.0, 3.0), (0.0, 2.0), (0.0, 4.0), (0.0, 2.0), (0.0, 2.0)),
    sprays=((5.0 - ON_M, 10.0 - OFF_M), (14.0 - ON_M, 16.0 - OFF_M)),
)
LENGTH_M = 7.0


def painted() -> Painted:
    return Painted(load_trajectory(LINES, VEHICLE), VEHICLE)


def share(run: Run) -> float:
    return run.onboard.painted.coverage_pct / 100.0


@pytest.mark.parametrize(("follower", "noise"), [("mpc", "default"), ("pure-pursuit", "none")])
def test_an_undisturbed_run_is_all_painted(follower: str, noise: str) -> None:
    run = start(LINES, follower, noise, seed=2)
    assert run.onboard.painted.ids == ("s1", "s2", "s4")
    before = 0.0
    while run.onboard.state != DONE:
        run.tick()
        assert share(run) >= before - 1e-12
        before = share(run)
    assert run.onboard.painted.coverage_pct == pytest.approx(100.0, abs=1e-9)
    assert run.onboard.painted.fractions == pytest.approx([1.0, 1.0, 1.0])


def test_segments_count_by_the_lines_that_the_nozzle_draws() -> None:
    """A bend to the left draws a longer line with the nozzle on the right, and a bend to the right a shorter one."""
    bends = [(0.0, 3.0), *clothoid(0.5, 1.0, 8), (0.5, 2.0), (0.25, 0.5), (-0.25, 0.5), (-0.5, 2.0), (0.0, 3.0)]
    plan = trajectory(chain(*bends), speed=0.3, sprays=((4.0, 6.0), (7.0, 9.0)))
    known = Painted(load_trajectory(plan, VEHICLE), VEHICLE)
    known.add(0.0, 6.5)
    left, right = (1.0 - curvature * VEHICLE.tool.nozzle_y_m for curvature in (0.5, -0.5))
    assert known.belief().coverage_pct == pytest.approx(100.0 * left / (left + right), abs=0.5)


def test_it_grows_with_the_robots_own_progress() -> None:
    run = start(LINES)
    run.until_arc(4.9)
    assert run.onboard.painted.fractions == [0.0, 0.0, 0.0]
    run.until_arc(6.5)
    arc_m = run.onboard.status.arc_length_m
    assert run.onboard.painted.fractions == pytest.approx([(arc_m - 5.0) / 3.0, 0.0, 0.0], abs=1e-3)
    assert share(run) == pytest.approx((arc_m - 5.0) / LENGTH_M, abs=1e-3)
    run.until_arc(12.0)
    assert run.onboard.painted.fractions == pytest.approx([1.0, 1.0, 0.0])


def test_a_joint_that_is_painted_twice_counts_once() -> None:
    run = start(LINES)
    run.until_arc(6.5)
    run.onboard.pause()
    run.ticks(150)
    closed_m = 5.0 + share(run) * LENGTH_M
    run.onboard.resume()
    run.until_arc(7.5)
    arc_m = run.onboard.status.arc_length_m
    assert len(run.painted) == 2
    assert run.painted[1][0] == pytest.approx(closed_m - 0.005, abs=0.002), "the joint overlaps by 5 mm"
    assert share(run) == pytest.approx((arc_m - 5.0) / LENGTH_M, abs=2e-4)
    run.until(DONE)
    assert run.onboard.painted.coverage_pct == pytest.approx(100.0, abs=1e-9)


def test_stretches_are_united_and_a_gap_stays_one() -> None:
    belief = painted()
    belief.add(5.0, 6.5)
    belief.add(6.495, 7.0)
    assert belief.belief().fractions == pytest.approx([2.0 / 3.0, 0.0, 0.0])
    belief.add(7.5, 9.0)
    assert belief.belief().fractions == pytest.approx([2.5 / 3.0, 0.5, 0.0])
    assert belief.belief(7.0, 7.25).fractions == pytest.approx([2.75 / 3.0, 0.5, 0.0])
    assert belief.belief().fractions == pytest.approx([2.5 / 3.0, 0.5, 0.0]), "what still falls is not kept"
    assert belief.belief().coverage_pct == pytest.approx(100.0 * 3.5 / LENGTH_M)


def test_what_is_owed_no_more_is_not_missed() -> None:
    belief = painted()
    belief.add(5.006, 9.996)
    belief.add(14.02, 15.98)
    assert belief.belief().fractions == pytest.approx([1.0, 1.0, 0.98])


def test_paint_that_was_none_is_taken_back() -> None:
    run = start(LINES)
    run.until_arc(7.0)
    run.rig.valve_stuck = False
    run.until(PAUSED)
    assert "paint" in run.onboard.status.reason
    painted_m, arc_m = 5.0 + share(run) * LENGTH_M, run.onboard.status.arc_length_m
    assert arc_m > 7.1
    assert painted_m == pytest.approx(7.0, abs=0.03), "the tank's level has told where it began"


def test_a_process_that_goes_on_takes_what_lies_before_for_painted() -> None:
    belief = painted()
    belief.restore(7.0)
    assert belief.belief().fractions == pytest.approx([2.0 / 3.0, 0.0, 0.0])
    belief = painted()
    belief.restore(12.0)
    assert belief.belief().fractions == pytest.approx([1.0, 1.0, 0.0])
    run = start(LINES)
    run.onboard.abort()
    run.onboard.reset()
    run.onboard.load(LINES, Checkpoint(0, 7.2, 6.5))
    assert share(run) == pytest.approx(1.5 / LENGTH_M)


def test_nothing_is_painted_without_a_trajectory_and_all_of_nothing_with_one() -> None:
    run = start(trajectory(chain((0.0, 2.0))))
    assert run.onboard.painted == ((), [], 100.0)
    run.onboard.abort()
    run.onboard.reset()
    assert run.onboard.painted == ((), (), 0.0)


def test_a_short_transition_over_which_the_valve_opens_early_is_not_sprayed() -> None:
    plan = trajectory(chain((0.0, 5.0), (0.0, 0.01), (0.0, 3.0), (0.0, 4.0)), sprays=((5.01 - ON_M, 8.01 - OFF_M),))
    assert Painted(load_trajectory(plan, VEHICLE), VEHICLE).ids == ("s2",)


def test_the_valves_delay_spills_onto_no_other_segment() -> None:
    late = trajectory(chain((0.0, 5.0), (0.0, 3.0), (0.0, 4.0)), sprays=((5.0, 8.0),))
    run = start(late)
    assert run.onboard.painted.ids == ("s1",)
    run.until(DONE)
    assert run.onboard.painted.coverage_pct == pytest.approx(100.0)


def test_a_process_that_ends_while_it_brakes_from_dry_paint_still_owes_from_the_last_good_drop() -> None:
    sprayer = Sprayer(load_trajectory(LINES, VEHICLE), VEHICLE, ComputerState.sized(2)())
    place_m = 4.5
    while place_m < 7.2:
        sprayer.step(place_m, 1.0, allowed=True)
        place_m += 0.01
    sprayer.dry(place_m, 1.0, 0.2)
    owed_m = place_m - 0.2 - JOINT_OVERLAP_M
    assert sprayer.owed_from_m == pytest.approx(owed_m, abs=0.02)
    for braked_m in (0.0, 0.1, 0.5):
        assert sprayer.owed_if_it_ended(place_m + braked_m) == sprayer.owed_from_m


@pytest.mark.parametrize("to_m", [6.5, 7.0, 4.0])
def test_paint_that_was_found_to_be_dry_from_the_first_drop_on_counts_for_nothing(to_m: float) -> None:
    """The last good drop then fell before the place where the first one was to fall."""
    belief = painted()
    belief.add(7.0, to_m)
    assert belief.belief().fractions == [0.0, 0.0, 0.0]
    belief.add(5.0, 6.0)
    assert belief.belief(7.0, to_m).fractions == pytest.approx([1.0 / 3.0, 0.0, 0.0])
