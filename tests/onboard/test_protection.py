"""Protection against contact: clearances, the speed that they allow, stops, and how the robot goes on."""

import math
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks._stops_for_things import NOTHING, post, with_lidar
from benchmarks.protection import LEFT_OUT, without
from tests.onboard.rig import chain, reversing, start, trajectory
from touchline.onboard import Onboard
from touchline.onboard import tracking_state as tracking
from touchline.onboard.control import PurePursuitFollower
from touchline.onboard.control.follower import BodyTwist
from touchline.onboard.drives.onboard_drive import drive_of
from touchline.onboard.executive.move_off import MoveOffRules
from touchline.onboard.perception.blind_sector import blind_sector_rad
from touchline.onboard.perception.hits import Hits
from touchline.onboard.protection.clearance import clearance
from touchline.onboard.protection.stopping import latest_at, speed_to_stop_in, stopping_m, stopping_with
from touchline.onboard.protection.way import hold_to_cap
from touchline.schemas.messages import PauseStatus, TraversalStatus
from touchline.schemas.onboard import MoveOffLimits, OnboardConfig
from touchline.schemas.vehicles import LidarSpec, Protection, Vehicle

VEHICLE = with_lidar(Vehicle())
BODY = np.array(VEHICLE.body.footprint_m)
RADIUS_M = float(np.hypot(*BODY.T).max())
RUNNING, PAUSED, DONE = TraversalStatus.RUNNING, TraversalStatus.PAUSED, TraversalStatus.DONE


def ruled(**rules):
    return VEHICLE.model_copy(update={"protection": Protection(**rules)})


class Drive:
    """A robot on a rig, and the hits that it is given ten times a second, as `things` of its place."""

    def __init__(self, plan, things=lambda run: NOTHING, vehicle=VEHICLE, standing=0):
        self.run, self.things, self.standing = start(plan, vehicle=vehicle), things, standing
        self.events, self.silent, self.fastest = [], False, 0.0

    @property
    def onboard(self):
        return self.run.onboard

    @property
    def x(self):
        return self.run.rig.x

    def ticks(self, count):
        for _ in range(count):
            if self.run.rig.tick % 10 == 0 and not self.silent:
                points = self.things(self.run.rig)
                standing = len(points) if self.standing else 0
                self.onboard.protection.take(Hits(points, self.run.rig.tick, 0.02, standing))
            self.run.tick()
            self.events += self.onboard.take_events()

    def until(self, condition, limit=3000):
        for _ in range(limit):
            if condition(self):
                return
            self.ticks(1)
        raise AssertionError(f"still {self.onboard.status} at x {self.x:.2f} m")

    def until_state(self, state):
        self.until(lambda drive: drive.onboard.state == state)

    def until_rest(self):
        self.until(lambda drive: abs(drive.run.rig.speed) < 1e-3 and abs(drive.run.rig.yaw_rate) < 1e-3)


LINE = trajectory(chain((0.0, 12.0)), sprays=((2.0, 10.0),))


@given(
    st.lists(st.tuples(st.floats(-2, 2), st.floats(-2, 2)), min_size=1, max_size=20),
    st.floats(-1, 1),
    st.floats(-1, 1),
    st.floats(-4, 4),
)
@settings(deadline=None)
def test_clearance_is_the_exact_distance_to_the_outline(points, x, y, heading):
    cos, sin = math.cos(heading), math.sin(heading)
    outline = shapely.Polygon([(x + cos * a - sin * b, y + sin * a + cos * b) for a, b in BODY])
    expected = []
    for point in map(shapely.Point, points):
        apart = outline.exterior.distance(point)
        expected.append(-apart if outline.contains(point) else apart)
    distance, nearest = clearance(BODY, RADIUS_M, (x, y, heading), np.array(points), 9.0)
    assert distance == pytest.approx(min(expected), abs=1e-9)
    assert expected[nearest] == pytest.approx(distance, abs=1e-9)


@given(st.floats(0.02, 3), st.floats(0.05, 6), st.floats(0.01, 0.5), st.floats(0.0, 1.0), st.floats(0.01, 1))
@settings(deadline=None)
def test_no_way_of_stopping_takes_longer_or_farther(speed, braking, lag, begins, share):
    """Braking begins at any time within the reaction; the actuators follow a ramp of commands late."""
    stopping = stopping_with(braking, lag)
    assert speed_to_stop_in(stopping_m(speed, stopping), stopping) == pytest.approx(speed)
    at = share * stopping_m(speed, stopping)
    latest = latest_at(at, speed, stopping)
    v, command, x, t, dt = speed, speed, 0.0, 0.0, 1e-3
    while v > 0.02:
        command = max(command - braking * dt, 0.0) if t >= begins * 0.02 else command
        v += (command - v) * (1.0 - math.exp(-dt / lag))
        x, t = x + v * dt, t + dt
        if x <= at:
            assert t <= latest + 2.0 * dt
    assert x <= stopping_m(speed, stopping) + lag * 0.02 + 2e-3 * speed + 1e-3
    assert t <= stopping.reaction_s + speed / braking + stopping.creep_s + 5.0 * dt


def test_a_wait_with_a_pose_that_fixes_contradict_needs_a_person_as_another_stop_does():
    drive = Drive(LINE, lambda _: post(8.0, 0.0))
    drive.until_state(PAUSED)
    drive.ticks(3500)
    drive.run.rig.fix_offset_m = 0.6, -0.8  # it has been pushed
    drive.ticks(2500)
    assert drive.onboard.status.reason == "the fixes contradict the estimate"
    assert drive.onboard.status.pause.ends_by_itself
    drive.ticks(1000)
    assert not drive.onboard.status.pause.ends_by_itself
    why = "stopped for more than 30 s: the fixes contradict the estimate; resume to go on"
    assert drive.onboard.status.reason == why


def test_it_slows_down_stops_short_and_goes_on_by_itself_without_a_gap_in_the_paint():
    drive = Drive(LINE, lambda _: post(8.0, 0.0))
    drive.until_state(PAUSED)
    blocked, pause = drive.onboard.blocked, drive.onboard.status.pause
    assert (pause.cause, pause.ends_by_itself) == (PauseStatus.IN_THE_WAY, True)
    away = f"{blocked.distance_m:.1f} m from the robot"
    assert drive.onboard.status.reason == f"something that stands is in the way, {away}"
    assert not blocked.moving
    assert blocked.place_m == pytest.approx((7.9, 0.0), abs=0.01)
    # A thing that may walk leaves room: 1.5 m/s for the age of a scan, reaction and creep, margin and error.
    assert drive.x + 0.75 + blocked.distance_m == pytest.approx(7.9, abs=0.02)
    assert 0.45 < blocked.distance_m < 0.7
    drive.ticks(3500)  # longer than other stops may last
    assert drive.onboard.state == PAUSED
    drive.things = lambda _: NOTHING
    drive.ticks(110)
    assert drive.onboard.warning is not None
    drive.until_state(RUNNING)
    assert drive.onboard.blocked is None
    drive.until_state(DONE)
    painted = drive.run.painted
    assert painted[0][0] == pytest.approx(2.0, abs=0.03)
    assert painted[-1][1] == pytest.approx(10.0, abs=0.04)
    assert max(after[0] - before[1] for before, after in pairwise(painted)) < 0.002


@pytest.mark.parametrize(
    ("rules", "standing", "least", "most"),
    [
        ({"mode": "protect"}, False, 0.06, 0.12),
        ({"mode": "protect", "margin_m": 0.3}, False, 0.31, 0.37),
        ({"thing_speed_mps": 3.0}, False, 0.8, 1.3),
        ({}, True, 0.06, 0.12),
    ],
)
def test_it_comes_as_close_as_it_may(rules, standing, least, most):
    drive = Drive(LINE, lambda _: post(8.0, 0.0), ruled(**rules), standing)
    drive.until_state(PAUSED)
    drive.until_rest()
    assert least < 7.9 - drive.x - 0.75 < most


def beside(gap_m, slope=0.0):
    """A wall on the right, nearer by the slope farther on, as a lidar with noise sees it."""
    rng, x = np.random.default_rng(1), np.arange(-2.0, 14.0, 0.02)
    return lambda _: np.column_stack((x, slope * x - 0.5 - gap_m + rng.normal(0.0, 0.005, len(x))))


def test_it_drives_on_along_a_wall_to_which_it_is_too_near():
    drive = Drive(LINE, beside(0.1), ruled(mode="protect", margin_m=0.1))  # 2 cm, the error of hits, are missing
    drive.until_state(DONE)


def test_it_does_not_creep_into_a_wall_to_which_it_is_too_near():
    drive = Drive(LINE, beside(0.1, 0.01), ruled(mode="protect", margin_m=0.1))
    drive.ticks(6000)
    assert 0.05 < 0.1 - 0.01 * drive.x < 0.09
    assert drive.onboard.state == PAUSED


def test_a_robot_beside_what_may_move_tells_how_far_away_it_has_to_be_unless_the_plan_knows_it():
    drive = Drive(LINE, beside(0.3))
    drive.until_state(PAUSED)
    needed = "something that may move is 0.3 m from the robot, which needs 0.5 m: move either, or name it in the plan"
    assert drive.onboard.status.reason == needed
    drive = Drive(LINE, beside(0.3), standing=True)
    drive.until_state(DONE)


@pytest.mark.parametrize("rules", [{}, {"mode": "protect"}])
def test_zones_are_where_a_thing_slows_it_down_or_stops_it(rules):
    drive = Drive(LINE, vehicle=ruled(**rules))
    drive.until(lambda drive: drive.x > 4.0 and drive.run.rig.tick % 10 == 0)
    protection, speed = drive.onboard.protection, drive.run.rig.speed

    def allowed(zone, off_m, ahead_m):
        """Speeds that things allow at so far outside of a zone, where they are ahead of the robot's origin by more."""
        found = []
        for at in np.linspace(0.0, 1.0, 40):
            point = np.array(shapely.Polygon(zone).buffer(off_m).exterior.interpolate(at, normalized=True).coords)
            if point[0, 0] > drive.x + ahead_m:
                protection.take(Hits(point, drive.run.rig.tick, 0.02))
                protection.watch(protection._driver)
                found.append(protection._way.limit_mps)
        return np.array(found)

    protection.take(Hits(NOTHING, drive.run.rig.tick, 0.02))
    zones = protection.zones
    assert (allowed(zones.slow_m, -0.07, 0.8) < speed).all()
    assert (allowed(zones.slow_m, 0.12, 0.8) >= speed).all()
    assert (allowed(zones.stop_m, -0.07, 0.75) == 0.0).all()
    assert (allowed(zones.stop_m, 0.15, 0.75) > 0.0).all()
    assert shapely.Polygon(zones.slow_m).buffer(0.02).contains(shapely.Polygon(zones.stop_m))


def test_who_steps_out_makes_it_brake_hard_at_once_with_the_valve_shut():
    drive = Drive(LINE)
    drive.until(lambda drive: drive.x > 5.0)
    assert drive.run.command.valve
    at, speed = drive.x, drive.run.rig.speed
    drive.things = lambda _: post(at + 1.3, 0.2, 0.25)
    drive.until_state(PAUSED)
    assert not drive.run.command.valve
    assert drive.onboard.blocked.moving
    assert "moves" in drive.onboard.status.reason
    drive.until_rest()
    assert drive.x - at < speed * (0.11 + 0.05) + speed**2 / (2.0 * 4.0)
    drive.things = lambda _: NOTHING
    drive.until_state(DONE)
    painted = drive.run.painted
    assert len(painted) == 2
    assert painted[1][0] - painted[0][1] < 0.002


@pytest.mark.parametrize(("speed_mps", "moves"), [(0.6, True), (0.0, False)])
def test_who_walks_before_a_robot_that_does_not_know_its_heading_yet_moves(speed_mps, moves):
    drive = Drive(LINE)
    for n in range(20):
        walker = post(1.6, speed_mps * (0.1 * n - 1.0), 0.2)
        drive.onboard.protection.take(Hits(walker, drive.run.rig.tick, 0.36))
        drive.run.ticks(10)
    assert drive.onboard.blocked.moving == moves


def test_a_thing_behind_keeps_it_from_backing_up_for_owed_paint():
    drive = Drive(LINE)
    drive.until(lambda drive: drive.x > 5.0)
    at = drive.x
    drive.things = lambda _: post(at + 1.3, 0.0, 0.25)
    drive.until_state(PAUSED)
    drive.until_rest()
    stood = drive.x
    drive.things = lambda rig: post(stood - 0.75, 0.0)
    drive.ticks(600)
    assert drive.onboard.state == PAUSED
    assert drive.x == pytest.approx(stood, abs=1e-3)
    drive.things = lambda _: NOTHING
    drive.until_state(DONE)


def test_a_turn_on_the_spot_waits_for_what_its_tail_would_sweep():
    plan = reversing((1, [(0.0, 3.0)]), 0.5 * math.pi, (1, [(0.0, 3.0)]))
    beside = post(3.0 - 0.3, 0.55, 0.05)  # clear of the straight way, not of the turn
    drive = Drive(plan, lambda _: beside, ruled(mode="protect"))
    drive.until_state(PAUSED)
    drive.until_rest()
    assert drive.x == pytest.approx(3.0, abs=0.02)
    assert 0.8 < drive.run.rig.heading < 1.5
    drive.things = lambda _: NOTHING
    drive.until_state(DONE)


def test_a_leg_driven_backward_is_protected():
    plan = reversing((1, [(0.0, 3.0)]), (-1, [(0.0, 3.0)]))
    drive = Drive(plan, vehicle=ruled(mode="protect"))
    drive.until(lambda drive: drive.x > 2.9)
    drive.things = lambda _: post(0.5, 0.0)
    drive.until_state(PAUSED)
    drive.until_rest()
    assert 0.06 < drive.x - 0.35 - 0.6 < 0.12


@pytest.mark.parametrize("leg", [1, -1], ids=["forward", "backward"])
def test_against_its_way_it_only_creeps_whatever_the_follower_wants(leg, monkeypatch):
    drive = Drive(reversing((leg, [(0.0, 6.0)])), vehicle=ruled(mode="protect"))
    drive.until(lambda drive: leg * drive.x > 3.0)
    monkeypatch.setattr(PurePursuitFollower, "step", lambda *_: BodyTwist(-0.5 * leg, 0.0))
    speeds = list[float]()
    for _ in range(300):
        drive.ticks(1)
        speeds.append(leg * drive.run.rig.speed)
    assert speeds[0] > 0.5 and -0.03 < min(speeds) < 0.0


@pytest.mark.parametrize(("cap_mps", "left_mps"), [(1.0, 0.02), (0.01, 0.01), (0.0, 0.0)])
def test_nor_does_it_creep_faster_than_the_cap(cap_mps, left_mps):
    drive = Drive(LINE, vehicle=ruled(mode="protect"))
    drive.until(lambda drive: drive.x > 3.0)
    computer, figures = drive.onboard._state, drive_of(VEHICLE).figures
    computer.leg.now[tracking.SPEED], computer.way.cap_mps = 0.0, cap_mps
    actuators = np.full(2, -0.5 / VEHICLE.drive.wheel_radius_m)
    hold_to_cap(figures, computer.array, actuators)
    assert -actuators * VEHICLE.drive.wheel_radius_m == pytest.approx(left_mps, abs=1e-3)


def test_a_silent_lidar_stops_it_until_it_speaks_again():
    drive = Drive(LINE)
    drive.until(lambda drive: drive.x > 5.0)
    drive.silent = True
    drive.ticks(40)
    assert drive.onboard.state == PAUSED
    assert drive.onboard.status.reason == "the lidar is silent: nothing from it for more than 0.25 s"
    assert drive.onboard.blocked is None
    drive.silent = False
    drive.until_state(DONE)


def test_it_says_once_what_is_left_out():
    half = LidarSpec(name="front", first_rad=-0.75 * math.pi, step_rad=0.01, beams=472)
    drive = Drive(LINE, vehicle=VEHICLE.model_copy(update={"sensors": (half,)}))
    drive.ticks(300)
    told = [event.text for event in drive.events if event.code == "protection"]
    assert len(told) == 1
    for part in ("faster than 1.5 m/s", "90° round the robot", "behind other things", "less grip than 0.6"):
        assert part in told[0]


def test_less_is_seen_than_the_speed_needs():
    """A lidar that sees dark things at 1.5 m only."""
    near = LidarSpec(name="lidar", scan_s=0.0, dark_m=1.5)
    drive = Drive(LINE, vehicle=VEHICLE.model_copy(update={"sensors": (near,)}))
    drive.until(lambda drive: drive.x > 4.0)
    assert 0.1 < drive.run.rig.speed < 0.6


def test_something_too_fast_is_reported():
    drive = Drive(LINE, lambda rig: post(rig.x, 1.6) if rig.x < 5.0 else post(rig.x, 0.9))
    drive.until(lambda drive: drive.x > 4.0)
    assert not any("was not" in event.text or "did not see" in event.text for event in drive.events)
    drive.ticks(300)
    assert sum("did not see before" in event.text for event in drive.events) == 1


def test_a_stop_that_took_longer_lowers_the_braking_that_it_counts_on():
    drive = Drive(LINE)
    drive.until(lambda drive: drive.x > 5.0)
    at = drive.x
    drive.onboard.protection._braking_from_mps = 0.0
    drive.things = lambda _: post(at + 1.3, 0.0, 0.25)
    drive.until_state(PAUSED)
    drive.onboard.protection._braked_m += 0.5  # as on ice
    before = drive.onboard.protection.braking_mps2
    drive.until_rest()
    drive.ticks(60)
    assert drive.onboard.protection.braking_mps2 < 0.7 * before
    assert any("the robot counts on a deceleration of" in event.text for event in drive.events)


@pytest.mark.parametrize(("grip", "braking"), [(0.6, 4.0), (0.35, 0.8 * 0.35 * 9.80665)])
def test_braking_is_what_drive_and_ground_give(grip, braking):
    onboard = Onboard(VEHICLE, OnboardConfig.model_validate({"drive": {"grip": grip}}))
    assert onboard.protection.braking_mps2 == pytest.approx(braking)


@pytest.mark.parametrize(
    ("hits", "said"),
    [
        (Hits(np.zeros(3), 1, 0.0), "points_m has the shape"),
        (Hits(np.full((1, 2), np.nan), 1, 0.0), "not finite"),
        (Hits(NOTHING, 1, -1.0), "error_m is -1.0"),
        (Hits(NOTHING, 1, 0.0, 2), "standing is 2 of 0 points"),
    ],
)
def test_bad_hits_are_refused(hits, said):
    with pytest.raises(ValueError, match=said):
        Onboard(VEHICLE, OnboardConfig()).protection.take(hits)


def test_without_a_lidar_nothing_is_watched():
    onboard = Onboard(Vehicle(), OnboardConfig())
    onboard.protection.take(Hits(post(0.0, 0.0), 1, 0.0))
    assert not onboard.protection.on
    assert not onboard.protection.watches_all_round


def test_a_wait_has_no_limit_where_nobody_can_come_close_unseen():
    usual = MoveOffRules(MoveOffLimits(), Vehicle())
    watching = MoveOffRules(MoveOffLimits(), Vehicle(), watches_all_round=True)
    limited = MoveOffRules(MoveOffLimits(person_after_s=90.0), Vehicle(), watches_all_round=True)
    assert [each.longest_s(waits=True) for each in (usual, watching, limited)] == [30.0, math.inf, 90.0]
    assert [each.longest_s(waits=False) for each in (usual, watching, limited)] == [30.0, 30.0, 90.0]


@pytest.mark.parametrize(
    ("fields", "blind"),
    [
        ([(-math.pi, 2.0 * math.pi)], 0.0),
        ([(-0.75 * math.pi, 1.5 * math.pi)], 0.5 * math.pi),
        ([(-0.5 * math.pi, 1.5 * math.pi), (0.5 * math.pi, 1.5 * math.pi)], 0.0),
        ([(0.9 * math.pi, 0.2 * math.pi)], 1.8 * math.pi),
    ],
)
def test_blind_sector(fields, blind):
    lidars = [LidarSpec(name=f"l{i}", first_rad=a, step_rad=w / 400, beams=400) for i, (a, w) in enumerate(fields)]
    assert blind_sector_rad(lidars) == pytest.approx(blind, abs=0.001)


@pytest.mark.parametrize("name", LEFT_OUT)
def test_no_contact_in_motion_among_adversaries_unless_a_figure_is_left_out(name):
    met = without(LEFT_OUT[name], 10.0)
    assert met.standing + met.moving > 40
    assert (met.moving == 0) == (name == "nothing")
