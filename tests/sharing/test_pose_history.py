"""Robots are seen at the same instants, whatever arrives first of what they tell."""

import math

import numpy as np
import pytest

from touchline.jobs.shared.body_gap import BodyGap
from touchline.jobs.shared.pose_history import PATIENCE_S, PoseHistory, simultaneous_poses
from touchline.schemas.vehicles import Vehicle

BEGUN_S = 1.7e9
"""Of the wall clock: as large as it is, so that what is lost to rounding shows."""


def rows(times_s, xs, y=0.0):
    """Sent at these times after the beginning, at these places."""
    count = len(times_s)
    return np.column_stack((BEGUN_S + np.array(times_s), xs, np.full(count, y), np.zeros(count)))


class Pair:
    """Two robots of which one makes way for the other."""

    def __init__(self):
        self.seen, self.gap, self.touched = {"a": PoseHistory(), "b": PoseHistory()}, BodyGap(Vehicle()), []

    def look(self, now_s, stand=()):
        if poses := simultaneous_poses(self.seen, set(stand), BEGUN_S + now_s):
            assert len({len(each) for each in poses.values()}) == 1
            self.touched += self.gap.look(poses)


@pytest.mark.parametrize("late_s", [0.0, 0.1, 0.5, 1.5])
def test_who_has_made_way_is_not_touched_however_late_that_is_heard(late_s):
    pair, times_s = Pair(), np.arange(0.0, 4.0, 0.01)
    leaves, comes = rows(times_s, 20.0 * times_s), rows(times_s, 20.0 * times_s - 5.0)
    for now_s in np.arange(0.0, 8.0, 0.05):
        for name, way, delay_s in (("a", leaves, late_s), ("b", comes, 0.0)):
            sent_s = way[:, 0] - BEGUN_S + delay_s
            pair.seen[name].add(way[(sent_s > now_s - 0.05) & (sent_s <= now_s)])
        pair.look(now_s)
    assert pair.touched == []
    nose_to_tail_m = np.ptp(np.array(Vehicle().body.footprint_m)[:, 0])
    assert pair.gap.closest_m == pytest.approx(5.0 - nose_to_tail_m, abs=1e-6)


@pytest.mark.parametrize("late_s", [0.0, 0.3])
def test_a_contact_is_found_once_though_both_have_long_driven_on(late_s):
    pair, times_s = Pair(), np.arange(0.0, 4.0, 0.01)
    comes, meets = rows(times_s, 4.0 * times_s), rows(times_s, 8.0 - 4.0 * times_s, 0.3)
    pair.seen["a"].add(comes)
    pair.seen["b"].add(meets[:1])
    pair.look(late_s)
    pair.seen["b"].add(meets[1:])
    for now_s in (4.0, 4.0 + late_s, 6.0, 9.0):
        pair.look(now_s)
    assert sorted(pair.touched) == ["a", "b"] and pair.gap.closest_m == 0.0


def test_who_stands_is_touched_at_once_and_who_is_silent_after_a_while():
    ahead, last = rows([0.0], [3.0]), rows(np.arange(0.0, 1.0, 0.01), np.arange(0.0, 4.0, 0.04))
    for stand, least_s in ((("a",), 0.0), ((), PATIENCE_S)):
        pair = Pair()
        pair.seen["a"].add(ahead)
        pair.seen["b"].add(last)
        found_s = math.inf
        for now_s in np.arange(1.0, 5.0, 0.1):
            pair.look(now_s, stand)
            if pair.touched:
                found_s = min(found_s, now_s - 1.0)
        assert sorted(pair.touched) == ["a", "b"]
        assert found_s <= least_s + 0.1 and (not least_s or found_s > 0.5 * least_s)


def test_nobody_is_in_the_way_while_it_is_carried_and_nothing_is_kept_that_is_not_asked_for():
    pair = Pair()
    pair.seen["b"].add(rows([0.0, 0.1], [0.0, 0.0]))
    pair.look(0.1)
    assert not pair.touched
    for k in range(1000):
        pair.seen["b"].add(rows([0.2 + 0.01 * k], [0.001 * k]))
        pair.look(0.2 + 0.01 * k)
    assert len(pair.seen["b"].rows) <= 2
    pair.seen["a"].add(rows([11.0], [0.5]))
    pair.seen["a"].forget()
    pair.look(15.0)
    assert not pair.touched
    pair.seen["a"].add(rows([16.0], [0.5]))
    pair.seen["b"].add(rows([16.0], [0.5]))
    pair.look(16.1)
    assert sorted(pair.touched) == ["a", "b"]
