"""Traffic rules: who goes first where two paths come close, and that nobody is ever too near or waits for ever."""

import math
from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from touchline.coordination.traffic.conflicts import TimedPath, conflicts
from touchline.coordination.traffic.gates import CLEAR_M, authorities_m, gates
from touchline.coordination.traffic.timetable import timetable

RADIUS_M, APART_M = 0.5, 0.5
NEAREST_M = 2.0 * RADIUS_M + APART_M
TICK_S = 0.2
BRAKES_M, BACK_M = 0.5, 4.0


def path_along(corners, holds=None, delay_s=0.0, back_m=BACK_M):
    """A path along a polyline at 1 m/s; it may wait every 2 m, or where `holds` says."""
    corners = np.array(corners, dtype=float)
    knots = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))))
    arc = np.unique(np.concatenate((np.arange(0.0, knots[-1], 0.1), knots)))
    middles = np.column_stack([np.interp(arc, knots, axis) for axis in corners.T])
    holds = np.arange(0.0, knots[-1], 2.0) if holds is None else np.array(holds)
    return TimedPath(arc, middles, arc + delay_s, RADIUS_M, holds, BRAKES_M, back_m)


def place_on(path, arc_m):
    return [np.interp(arc_m, path.arc_m, axis) for axis in path.middles.T]


WEST_EAST = path_along([(-10, 0), (10, 0)])
SOUTH_NORTH = path_along([(0, -13), (0, 7)])


def test_two_crossing_paths_are_one_conflict_about_the_crossing():
    (found,) = conflicts([WEST_EAST, SOUTH_NORTH], APART_M)
    one, other = found.places_m.T
    assert one.min() == pytest.approx(10.0 - NEAREST_M, abs=0.3) and one.max() == pytest.approx(11.5, abs=0.3)
    assert other.min() == pytest.approx(13.0 - NEAREST_M, abs=0.3) and other.max() == pytest.approx(14.5, abs=0.3)
    assert found.forced == -1 and found.possible


def test_who_comes_first_goes_first_and_the_other_waits_before_it():
    table = timetable([WEST_EAST, SOUTH_NORTH], APART_M)
    (gate,) = table.gates
    assert (gate.robot, gate.other) == (1, 0)
    assert gate.at_m == 10.0 <= 13.0 - NEAREST_M - CLEAR_M
    assert gate.clear_m == pytest.approx(10.0 + NEAREST_M + BACK_M, abs=0.3)
    assert table.waits_s[0] == 0.0 < table.waits_s[1]


def test_authority_grows_with_what_the_other_reports():
    table = timetable([WEST_EAST, SOUTH_NORTH], APART_M)
    assert authorities_m(table.gates, [0.0, 0.0]) == [math.inf, 10.0]
    assert authorities_m(table.gates, [15.0, 10.0]) == [math.inf, 10.0]
    assert authorities_m(table.gates, [16.0, 10.0]) == [math.inf, math.inf]
    assert authorities_m(table.gates, [math.inf, 0.0]) == [math.inf, math.inf]


def test_one_follows_another_as_far_as_it_will_not_come_back_to():
    ahead, behind = path_along([(0, 0), (40, 0)]), path_along([(-10, 0), (30, 0)])
    (found,) = conflicts([ahead, behind], APART_M)
    assert found.forced == 0, "it stands in the other's way from the start"
    steps = gates(found, 0, behind, BACK_M)
    assert [gate.at_m for gate in steps] == sorted({gate.at_m for gate in steps}) and len(steps) > 10
    for gate, after in zip(steps, [*steps[1:], None], strict=True):
        reaches_m = after.at_m if after else behind.end_m
        assert gate.clear_m >= reaches_m - 10.0 + NEAREST_M + BACK_M - 0.3


def test_whoever_ends_in_the_others_way_comes_last():
    ends = path_along([(0, -3), (0, 0)])
    table = timetable([WEST_EAST, ends], APART_M)
    assert {(gate.robot, gate.other) for gate in table.gates} == {(1, 0)}


def test_there_is_no_timetable_for_two_that_want_to_change_places_on_one_line():
    assert timetable([WEST_EAST, path_along([(10, 0), (-10, 0)])], APART_M) is None


def test_one_without_a_place_to_wait_at_goes_first():
    south_north = path_along([(0, -13), (0, 7)], holds=[12.9])
    table = timetable([WEST_EAST, south_north], APART_M)
    assert {(gate.robot, gate.other) for gate in table.gates} == {(0, 1)}


corner = st.tuples(st.integers(-8, 8), st.integers(-8, 8))
route = st.lists(corner, min_size=3, max_size=6, unique=True)
stall = st.tuples(st.integers(0, 2), st.floats(0, 60), st.floats(1, 40))


class Driver:
    """A robot on its path that, when it is stopped, needs room to brake, and goes back then to take up its work."""

    def __init__(self, path, speed_mps):
        self.path, self.speed_mps = path, speed_mps
        self.at_m = self.furthest_m = self.owed_m = 0.0
        self.rolls_to_m = self.back_to_m = None

    @property
    def there(self):
        return self.at_m >= self.path.end_m

    def step(self, until_m, stopped):
        until_m, ahead_m = min(until_m, self.path.end_m), self.at_m + self.speed_mps * TICK_S
        if self.back_to_m is None and stopped and not self.there:
            self.rolls_to_m = min(self.at_m + self.path.brakes_m, max(until_m, self.at_m))
            self.owed_m = max(self.owed_m, self.at_m)
            self.back_to_m = min(max(self.owed_m + self.path.brakes_m - self.path.back_m, 0.0), self.at_m)
        if stopped:
            self.at_m = self.at_m if self.rolls_to_m is None else min(ahead_m, self.rolls_to_m)
        elif self.back_to_m is not None:
            self.rolls_to_m, self.at_m = None, max(self.at_m - self.speed_mps * TICK_S, self.back_to_m)
            self.back_to_m = None if self.at_m == self.back_to_m else self.back_to_m
        else:
            self.at_m = max(self.at_m, min(ahead_m, until_m))
        self.furthest_m = max(self.furthest_m, self.at_m)


@settings(max_examples=20)
@given(
    st.lists(route, min_size=2, max_size=3),
    st.lists(stall, max_size=4),
    st.sampled_from([0.5, 4.0, 9.0]),
    st.integers(0, 2**32),
)
def test_whoever_is_stopped_whenever_nobody_is_too_near_and_all_arrive(routes, stalls, back_m, seed):
    paths = [path_along(each, back_m=back_m) for each in routes]
    table = timetable(paths, APART_M)
    if table is None:
        return
    count, random = len(paths), Random(seed)
    drivers, reported = [Driver(path, random.uniform(0.4, 1.2)) for path in paths], [0.0] * count
    now_s, closed = 0.0, list(table.gates)
    while not all(driver.there for driver in drivers):
        until = authorities_m(table.gates, reported)
        for gate in [gate for gate in closed if reported[gate.other] >= gate.clear_m]:
            closed.remove(gate)
            if random.random() < 0.3:  # the worst moment to be stopped: another one has just been let on
                stalls.append((gate.other, now_s, 10.0))
        for k, driver in enumerate(drivers):
            driver.step(until[k], any(robot == k and begin <= now_s < begin + lasts for robot, begin, lasts in stalls))
            if random.random() < 0.5:  # every other report is lost
                reported[k] = math.inf if driver.there else driver.furthest_m
        places = np.array([place_on(driver.path, driver.at_m) for driver in drivers])
        for k in range(count):
            for other in range(k):
                assert np.hypot(*(places[k] - places[other])) >= NEAREST_M - 1e-9
        now_s += TICK_S
        assert now_s < 1000.0, "somebody waits for ever"
