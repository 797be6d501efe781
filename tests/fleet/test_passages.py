"""Passages: found where they are, driven on the right, and entered one after another."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from tests.fleet.test_committed_plans import LIMITS, PERIOD_S, ROUNDING_M
from tests.with_full import with_full
from touchline.coordination.algorithms.team_algorithm import GoalWish
from touchline.coordination.free_area import FreeArea
from touchline.coordination.geodesics import Geodesics
from touchline.coordination.plans import move_order
from touchline.coordination.plans.committed_plans import CommittedPlans
from touchline.coordination.plans.leases import Lease
from touchline.coordination.plans.move_map import CLEARER_M, MoveMap, move_map_of
from touchline.coordination.plans.move_order import Move, MoveOrder
from touchline.coordination.plans.next_legs import Manner, NextLeg
from touchline.coordination.plans.ordered_ways import OrderedWays
from touchline.coordination.plans.passage_lanes import PassageLanes
from touchline.coordination.plans.passages import find_passages

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

APART_M = LIMITS.apart_m
TWO_M = 0.9


def hall(width_m: float, length_m: float = 1.0) -> FreeArea:
    """A hall of 10 × 5 m, divided by a wall with a passage in its middle."""
    left, right, low, high = 5.0 - 0.5 * length_m, 5.0 + 0.5 * length_m, 2.5 - 0.5 * width_m, 2.5 + 0.5 * width_m
    walls = [[(left, y0), (right, y0), (right, y1), (left, y1)] for y0, y1 in ((0.0, low), (high, 5.0))]
    return FreeArea.of([(0, 0), (10, 0), (10, 5), (0, 5)], walls)


@pytest.mark.parametrize("length_m", [0.1, 1.0, 3.0])
@pytest.mark.parametrize("width_m", [0.6, 1.2, 2.4])
def test_a_passage_is_found_with_its_width_and_its_mouths(width_m: float, length_m: float) -> None:
    [passage], others_m = find_passages(hall(width_m, length_m), APART_M)
    assert others_m == math.inf
    assert passage.width_m == pytest.approx(width_m, abs=0.02)
    mouths = sorted(passage.line[[0, -1]].real)
    assert mouths == pytest.approx([5.0 - 0.5 * length_m, 5.0 + 0.5 * length_m], abs=0.35)
    assert passage.line.imag == pytest.approx(2.5, abs=0.02)


_RIGHT = [(4, 0), (4, 1.4), (7.2, 1.4), (7.2, 5), (10, 5), (10, 9)]
_LEFT = [(3, 9), (3, 5), (6, 5), (6, 2.6), (4, 2.6), (4, 4), (0, 4)]
BENT = FreeArea.of([(0, 0), *_RIGHT, *_LEFT])
"""Two rooms, and an L-shaped corridor of 1.2 m between them."""


CORRIDOR = FreeArea.of([(0, 0), (7, 0), (7, 0.7), (3.7, 0.7), (3.7, 1.9), (3, 1.9), (3, 0.7), (0, 0.7)])
"""A corridor 0.7 m wide, with a place to stand aside in its middle."""


def test_a_passage_is_found_round_a_corner() -> None:
    [passage], _ = find_passages(BENT, APART_M)
    assert passage.width_m == pytest.approx(1.2, abs=0.02)
    assert sorted(passage.line[[0, -1]].real) == pytest.approx([4.0, 6.6], abs=0.1)


def test_neither_open_ground_nor_a_dead_end_nor_a_slit_is_a_passage() -> None:
    assert find_passages(FreeArea.of([(0, 0), (5, 0), (5, 4), (0, 4)]), APART_M) == ([], math.inf)
    dead_end = FreeArea.of([(0, 0), (5, 0), (5, 2), (8, 2), (8, 3), (5, 3), (5, 5), (0, 5)])
    passages, others_m = find_passages(dead_end, APART_M)
    assert not passages
    assert others_m == pytest.approx(1.0, abs=0.02)
    assert find_passages(hall(0.35), APART_M) == ([], math.inf)


def test_corridors_that_lead_to_corridors_are_no_passages() -> None:
    assert find_passages(CORRIDOR, APART_M) == ([], 0.0)


def legs_of(area: FreeArea, places: list[complex], goals: list[complex]) -> list[NextLeg]:
    """Legs of robots."""
    lanes = PassageLanes(find_passages(area, APART_M)[0], Geodesics(area, LIMITS.wall_m), APART_M, TWO_M)
    return lanes.legs(np.array(places), np.array(goals), 0.0)


def test_robots_keep_to_the_right_of_a_passage_and_of_the_way_to_it() -> None:
    legs = legs_of(hall(1.2), [4.2 + 2.2j, 5.8 + 2.8j, 1 + 4j, 9 + 1j], [9 + 1j, 1 + 1j, 9 + 4j, 1 + 1j])
    assert [leg.manner for leg in legs] == [Manner.LANE] * 4
    assert [leg.aim.imag for leg in legs[:2]] == pytest.approx([2.2, 2.8], abs=0.01)
    assert legs[2].aim.imag < 2.0
    assert legs[3].aim.imag > 3.0


def test_a_robot_stops_at_a_goal_within_a_passage_that_it_sees() -> None:
    stops, _ = legs_of(hall(1.2, 3.0), [4.6 + 2.3j, 5.6 + 2.8j], [4.9 + 2.5j, 1 + 2.5j])
    assert (stops.aim, stops.manner) == (4.9 + 2.5j, Manner.FREE)


def test_who_is_second_before_a_mouth_waits_and_only_for_its_own_direction() -> None:
    beside = [4.2 + 2.0j, 4.0 + 2.5j]
    first, second = legs_of(hall(1.2), beside, [9 + 1j, 9 + 2j])
    assert (first.manner, second.manner) == (Manner.LANE, Manner.WAIT)
    first, coming_out = legs_of(hall(1.2), beside, [9 + 1j, 1 + 2j])
    assert first.manner is Manner.LANE
    assert coming_out.manner is not Manner.WAIT


def test_who_is_alone_takes_the_shortest_way() -> None:
    [leg] = legs_of(hall(1.2), [1 + 4j], [9 + 4j])
    assert leg.manner is Manner.FREE


def test_a_goal_in_a_passage_is_driven_at_once_it_is_seen() -> None:
    legs = legs_of(hall(1.2, 4.0), [3.5 + 2.2j, 6.5 + 2.4j], [5.0 + 2.5j, 9.0 + 2.5j])
    assert (legs[0].manner, legs[0].aim) == (Manner.FREE, 5.0 + 2.5j)
    assert legs[1].manner is Manner.LANE


def through(area: FreeArea, starts: Floats, goals: Floats) -> float:
    """Time in which a team gets to its goals (s); plans keep apart and off walls."""
    team, now_s = CommittedPlans(starts, area, LIMITS), 0.0
    while np.abs(team.places - (goals[:, 0] + 1j * goals[:, 1])).max() > 0.1:
        assert now_s < 120.0, "somebody never arrives"
        team.update([GoalWish(x, y) for x, y in goals.tolist()])
        now_s += PERIOD_S
        assert team.closest_m >= LIMITS.apart_m - ROUNDING_M
        assert area.holds(team.plans[:, :, :2].reshape(-1, 2), LIMITS.wall_m - ROUNDING_M).all()
    return now_s


@pytest.mark.parametrize(("width_m", "most_s"), with_full((0.7, 50.0), (1.2, 25.0), full=[(0.92, 25.0), (2.0, 25.0)]))
def test_four_robots_on_each_side_of_a_passage_change_sides(width_m: float, most_s: float) -> None:
    y = np.array([0.8, 1.9, 3.0, 4.1])
    left, right = np.column_stack((np.full(4, 1.0), y)), np.column_stack((np.full(4, 9.0), y))
    starts = np.column_stack((np.concatenate((left, right)), np.repeat((0.0, math.pi), 4)))
    assert through(hall(width_m), starts, np.concatenate((right, left))) <= most_s


def test_robots_meet_in_a_bent_corridor() -> None:
    below, above = [(1.0, 1.0), (2.0, 1.0), (1.0, 3.0)], [(4.0, 7.0), (8.0, 7.0), (8.0, 6.0)]
    starts = np.array([(x, y, 0.0) for x, y in below + above])
    assert through(BENT, starts, np.array(above + below)) <= 40.0


def test_where_there_is_room_for_one_a_robot_waits_beside_the_way_until_it_has_the_lease() -> None:
    enters, waits, comes = legs_of(hall(0.7), [4.0 + 2.4j, 7.4 + 3.4j, 9 + 1j], [9 + 1j, 1 + 1j, 1 + 2j])
    assert enters.manner is Manner.LANE
    assert enters.aim.imag == pytest.approx(2.5, abs=0.01)
    assert waits.manner is Manner.WAIT
    assert comes.manner is Manner.LANE
    assert comes.aim.imag > 3.0


def test_robots_that_stand_behind_the_exit_keep_others_from_entering() -> None:
    stand = [6.0 + 2.2j, 6.5 + 2.2j, 7.0 + 2.2j]
    leg, *_ = legs_of(hall(0.7), [3.6 + 2.4j, *stand], [9 + 1j, *stand])
    assert leg.aim.real < 4.0
    leg, *_ = legs_of(hall(0.7), [3.6 + 2.4j, *stand[1:]], [9 + 1j, *stand[1:]])
    assert leg.aim.real > 4.0


def test_a_lease_is_for_one_direction_until_all_have_left() -> None:
    lease = Lease()
    lease.update(0.0, {0: (0, 1.0), 1: (1, 2.0), 2: (0, 3.0)}, (3, 3))
    assert lease.holders == {0, 2}
    lease.update(1.0, {0: (0, -0.5), 1: (1, 1.0)}, (3, 3))
    assert lease.holders == {0}
    lease.update(2.0, {1: (1, 1.0), 3: (0, 0.5)}, (3, 3))
    assert lease.holders == {1}  # who has waited longest, not who is nearest


def test_a_batch_is_closed_when_others_have_waited_for_ten_seconds() -> None:
    for now_s, joins in ((9.0, True), (11.0, False)):
        lease = Lease()
        lease.update(0.0, {0: (0, 1.0), 1: (1, 2.0)}, (3, 3))
        lease.update(now_s, {0: (0, -0.5), 1: (1, 2.0), 2: (0, 1.0)}, (3, 3))
        assert (2 in lease.holders) is joins
        lease.update(now_s + 5.0, {1: (1, 2.0), 3: (0, 1.0)}, (3, 3))
        assert lease.holders == {1}


def test_nobody_enters_for_whom_there_is_no_place_behind_the_exit() -> None:
    lease = Lease()
    lease.update(0.0, {0: (0, 1.0), 1: (0, 2.0)}, (0, 3))
    assert not lease.holders
    lease.update(1.0, {0: (0, 1.0), 1: (0, 2.0)}, (1, 3))
    assert lease.holders == {0}
    lease.update(2.0, {0: (0, -0.5), 1: (0, 1.0)}, (0, 3))
    assert lease.holders == {0}


def crossing() -> tuple[MoveMap, list[int], list[int]]:
    """MoveMap of the corridor, and starts and goals of two robots that have to pass each other."""
    ends = np.array([0.4 + 0.35j, 6.6 + 0.35j])
    return move_map_of(Geodesics(CORRIDOR, LIMITS.wall_m), ends, APART_M), [0, 1], [1, 0]


def test_places_of_a_roadmap_keep_apart_and_moves_close_those_near_to_them() -> None:
    roadmap, _, _ = crossing()
    apart_m = np.abs(roadmap.places[:, None] - roadmap.places) + np.diag(np.full(len(roadmap.places), np.inf))
    assert apart_m.min() >= APART_M + 0.1 - ROUNDING_M
    for line, closed, start in zip(roadmap.lines, roadmap.closed, roadmap.starts, strict=True):
        off_m = shapely.distance(line, shapely.points(roadmap.places.real, roadmap.places.imag))
        np.testing.assert_array_equal(closed, (off_m < APART_M + CLEARER_M) & (np.arange(len(closed)) != start))


def test_an_order_of_moves_leads_past_each_other_and_nobody_moves_where_another_stands() -> None:
    roadmap, at, goals = crossing()
    moves = MoveOrder(roadmap, goals).find(at)
    assert moves is not None
    for robot, move in moves:
        assert roadmap.starts[move] == at[robot]
        assert not any(roadmap.closed[move, place] for other, place in enumerate(at) if other != robot)
        at[robot] = int(roadmap.ends[move])
    assert at == goals


def test_robots_that_push_each_other_to_and_fro_take_one_goal_after_another(monkeypatch: pytest.MonkeyPatch) -> None:
    roadmap, at, goals = crossing()
    monkeypatch.setattr(move_order, "_TRIES_BY_GOAL", 0)
    assert MoveOrder(roadmap, goals).find(at) is None
    follows = [next(place for place in range(2, len(roadmap.places)) if abs(roadmap.places[place] - 1.9) < 0.4), 0]
    assert MoveOrder(roadmap, [goals[0], follows[0]]).find(follows) is not None


def test_ways_there_and_back_are_left_out_unless_somebody_passes_meanwhile() -> None:
    roadmap, _, _ = crossing()
    place = int(np.abs(roadmap.places - (3.5 + 0.5j)).argmin())
    there = roadmap.moves_from[place][0]
    back = next(move for move in roadmap.moves_from[roadmap.ends[there]] if roadmap.ends[move] == place)
    passes = int(np.flatnonzero(roadmap.closed[:, place])[0])
    assert not move_order.without_loops([Move(0, there), Move(0, back)], roadmap)
    needed = [Move(0, there), Move(1, passes), Move(0, back)]
    assert move_order.without_loops(needed, roadmap) == needed


def test_robots_pass_each_other_in_a_corridor_with_room_for_one() -> None:
    starts = np.array([(0.4, 0.35, 0.0), (6.6, 0.35, math.pi), (5.5, 0.35, 0.0)])
    assert through(CORRIDOR, starts, np.array([(6.6, 0.35), (0.4, 0.35), (5.5, 0.35)])) <= 90.0


def test_a_robot_waits_for_those_whose_moves_come_first() -> None:
    ways = OrderedWays(Geodesics(CORRIDOR, LIMITS.wall_m), APART_M)
    places, goals = np.array([0.4 + 0.35j, 6.6 + 0.35j]), np.array([6.6 + 0.35j, 0.4 + 0.35j])
    waits_s = 0
    for _ in range(200):
        legs = ways.legs(places, places, goals)
        assert legs is not None
        waits_s += sum(leg.aim == place and leg.left_m > 1.0 for leg, place in zip(legs, places, strict=True))
        for robot, leg in enumerate(legs):
            step = leg.aim - places[robot]
            places[robot] += step * min(1.0, 0.2 / max(abs(step), 1e-9))
        assert abs(places[0] - places[1]) >= APART_M
    assert waits_s > 5
    assert np.abs(places - goals).max() <= 0.1


def test_no_order_is_planned_while_goals_move_on_or_two_are_the_same() -> None:
    ways = OrderedWays(Geodesics(CORRIDOR, LIMITS.wall_m), APART_M)
    places: Complexes = np.array([0.4 + 0.35j, 6.6 + 0.35j])
    goals: Complexes = np.array([6.6 + 0.35j, 0.4 + 0.35j])
    assert ways.legs(places, places, goals) is not None
    assert ways.legs(places, places, goals + 0.1) is None
    waited = 0
    while ways.legs(places, places, goals - 0.1) is None:
        waited += 1
    assert waited == 12
    assert OrderedWays(Geodesics(CORRIDOR, LIMITS.wall_m), APART_M).legs(places, places, goals[[0, 0]]) is None
