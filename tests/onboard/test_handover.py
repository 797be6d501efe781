"""Trajectories that are joined where the robot is: at their start, standing there, and under way, without a stop."""

import math

import numpy as np
import pytest

from tests.onboard.rig import Rig, Run, chain, reversing, start, trajectory
from touchline.onboard import Onboard
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.vehicles import Vehicle

RUNNING, PAUSED, DONE = TraversalStatus.RUNNING, TraversalStatus.PAUSED, TraversalStatus.DONE
LINE = trajectory(chain((0.0, 12.0)))
SHORT = trajectory(chain((0.0, 3.0)))


def standing(x=0.0, y=0.0, heading=0.0):
    """A robot that has just been switched on, and knows where it is."""
    run = Run(Onboard(Vehicle(), OnboardConfig()), Rig(x=x, y=y, heading=heading))
    run.ticks(100)
    return run


def take_here(run, plan):
    return run.onboard.take_here(run.onboard.prepare(plan))


def take_over(run, plan):
    return run.onboard.take_over(run.onboard.prepare(plan))


def rest_of_line(from_m, aside_m=0.0, turned_rad=0.0, speed=1.0):
    """The rest of LINE from an arc length on, at speed from its first centimetre, and its difference."""
    left = 12.0 - from_m
    curves = chain((0.0, left), x=from_m, y=aside_m, heading=turned_rad)
    return trajectory(curves, speeds=[(0.0, speed), (left - 0.5, speed), (left, 0.0)])


@pytest.mark.parametrize(("x", "y", "heading"), [(0.0, 0.0, 0.0), (0.03, -0.03, 0.0), (0.0, 0.0, math.radians(9.0))])
def test_it_begins_where_it_stands_without_delay(x, y, heading):
    run = standing(x, y, heading)
    assert take_here(run, SHORT) == pytest.approx(4.0)
    run.onboard.start()
    run.ticks(30)
    assert run.rig.speed > 0.05
    run.until(DONE)
    run.ticks(100)
    assert (run.rig.x, run.rig.y) == pytest.approx((3.0, 0.0), abs=0.03)


def test_the_next_one_begins_where_the_last_one_ended():
    run = start(SHORT)
    run.until(DONE)
    run.ticks(100)
    heading_sigma = run.onboard.estimate.covariance[8]
    take_here(run, trajectory(chain((0.0, 2.0), x=3.0)))
    assert run.onboard.estimate.covariance[8] == heading_sigma, "the estimator goes on"
    run.onboard.start()
    run.until(DONE)
    run.ticks(100)
    assert run.rig.x == pytest.approx(5.0, abs=0.03)


@pytest.mark.parametrize(
    ("x", "y", "heading", "says"),
    [
        (0.06, 0.0, 0.0, r"0\.06 m and 0\.0° away.*at most 0\.05 m and 10°.*plan from where it stands \(0\.060 m"),
        (0.0, -0.06, 0.0, r"0\.06 m and 0\.0° away"),
        (0.0, 0.0, math.radians(11.0), r"0\.00 m and 11\.0° away"),
    ],
)
def test_further_off_it_is_refused_with_figures_and_remedy(x, y, heading, says):
    run = standing(x, y, heading)
    with pytest.raises(CommandRefused, match=says):
        take_here(run, SHORT)
    assert run.onboard.state == TraversalStatus.IDLE


def test_a_robot_that_does_not_know_where_it_is_refuses():
    run = Run(Onboard(Vehicle(), OnboardConfig()), Rig(silent=True))
    run.ticks(100)
    with pytest.raises(CommandRefused, match=r"has not started; let it stand.*or load without here"):
        take_here(run, SHORT)


@pytest.mark.parametrize(("follower", "behind_m"), [("mpc", 0.0), ("pure-pursuit", 2.0)])
def test_the_same_way_taken_over_is_driven_as_if_nothing_had_been(follower, behind_m):
    plain, replaced = start(LINE, follower, "default", seed=2), start(LINE, follower, "default", seed=2)
    for run in (plain, replaced):
        run.until_arc(4.0)
    assert take_over(replaced, rest_of_line(4.0 - behind_m)) == pytest.approx(8.25 + behind_m, abs=0.3)
    assert replaced.onboard.state == RUNNING
    assert replaced.onboard.status.arc_length_m == pytest.approx(behind_m, abs=0.02)
    for _ in range(600):
        plain.tick(), replaced.tick()
        assert (replaced.rig.x, replaced.rig.y) == pytest.approx((plain.rig.x, plain.rig.y), abs=2e-3)
        assert replaced.command.actuators == pytest.approx(plain.command.actuators, abs=0.3)
    replaced.until(DONE)
    assert "replaced" in [event.code for event in replaced.onboard.take_events()]


@pytest.mark.parametrize("differs", [{"aside_m": 0.008}, {"turned_rad": math.radians(0.8)}, {"speed": 1.03}])
def test_small_differences_are_taken_and_tracked(differs):
    run = start(LINE)
    run.until_arc(4.0)
    before = run.command.actuators
    take_over(run, rest_of_line(4.0, **differs))
    run.tick()
    assert run.command.actuators == pytest.approx(before, abs=1.0), "a tenth of the rims' speed"
    run.until_arc(7.5)
    aside = differs.get("aside_m", 0.0) + (run.rig.x - 4.0) * math.tan(differs.get("turned_rad", 0.0))
    assert run.rig.y == pytest.approx(aside, abs=2e-3)


@pytest.mark.parametrize(
    ("differs", "says"),
    [
        ({"aside_m": 0.012}, r"up to 1\.2 cm, 0\.0° and 0\.0 cm/s"),
        ({"turned_rad": math.radians(1.2)}, r"1\.2° and"),
        ({"speed": 0.93}, r"and 7\.0 cm/s, at most 1 cm, 1° and 5 cm/s are allowed; let it begin"),
    ],
)
def test_larger_differences_are_refused_with_the_largest(differs, says):
    run = start(LINE)
    run.until_arc(4.0)
    with pytest.raises(CommandRefused, match=says):
        take_over(run, rest_of_line(4.0, **differs))
    run.until(DONE)
    assert run.rig.x == pytest.approx(12.0, abs=0.05)


def test_one_that_begins_ahead_of_the_robot_or_the_other_way_is_refused():
    run = start(LINE)
    run.until_arc(4.0)
    with pytest.raises(CommandRefused, match=r"up to 10\.\d cm"):
        take_over(run, rest_of_line(run.onboard.status.arc_length_m + 0.1))
    with pytest.raises(CommandRefused, match="direction in which the robot drives"):
        take_over(run, reversing((-1, [(0.0, 2.0)])))


def test_paint_that_is_owed_or_to_come_is_not_given_up():
    painting = trajectory(chain((0.0, 12.0)), sprays=((5.0, 10.0),))
    run = start(painting)
    run.until_arc(4.0)
    with pytest.raises(CommandRefused, match="has work to do on its trajectory; let it finish, or abort first"):
        take_over(run, rest_of_line(4.0))
    run.until_arc(6.0)
    with pytest.raises(CommandRefused, match="is painting or owes paint"):
        take_over(run, rest_of_line(6.0))
    run.until_arc(10.8)
    take_over(run, rest_of_line(run.onboard.status.arc_length_m))
    run.until(DONE)
    assert len(run.painted) == 1


def test_what_paints_behind_the_robot_is_refused_and_ahead_of_it_is_painted():
    run = start(LINE)
    run.until_arc(4.0)
    profile = [(0.0, 1.0), (9.5, 1.0), (10.0, 0.0)]
    for begin, taken in ((1.0, False), (4.0, True)):
        plan = trajectory(chain((0.0, 10.0), x=2.0), speeds=profile, sprays=((begin, 6.0),))
        if taken:
            take_over(run, plan)
        else:
            with pytest.raises(CommandRefused, match="paints behind the robot"):
                take_over(run, plan)
    run.until(DONE)
    ((begin, end),) = run.painted
    assert (begin, end) == pytest.approx((6.0, 8.0), abs=0.1)


def test_it_takes_over_only_while_it_drives():
    run = start(LINE)
    with pytest.raises(CommandRefused, match="has not set off yet"):
        take_over(run, LINE)
    run.until_arc(4.0)
    run.onboard.pause()
    with pytest.raises(CommandRefused, match="cannot replace while paused; only while running"):
        take_over(run, rest_of_line(4.0))
    run.ticks(200)
    run.onboard.resume()
    with pytest.raises(CommandRefused, match="stands; send it again"):
        take_over(run, rest_of_line(run.onboard.status.arc_length_m))


@pytest.mark.parametrize("stop", [Onboard.pause, Onboard.estop])
def test_a_stop_and_going_on_are_along_the_one_that_took_over(stop):
    run = start(LINE)
    run.until_arc(4.0)
    fence = run.onboard._hazards.fence_arrays
    take_over(run, trajectory(chain((0.0, 2.0), (0.2, 4.0), x=4.0), speeds=[(0.0, 1.0), (5.5, 1.0), (6.0, 0.0)]))
    assert run.onboard._hazards.fence_arrays is not fence, "it is the new one's"
    run.until_arc(3.0)
    stop(run.onboard)
    run.ticks(200)
    assert abs(run.rig.speed) < 1e-3
    if run.onboard.state != PAUSED:
        run.onboard.reset()
    run.onboard.resume()
    run.until(DONE)
    run.ticks(100)
    x, y, _ = chain((0.0, 2.0), (0.2, 4.0), x=4.0)[-1].end
    assert np.hypot(run.rig.x - x, run.rig.y - y) < 0.03
