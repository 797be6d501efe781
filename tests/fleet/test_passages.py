"""Passages: found where they are, driven on the right, and entered one after another."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.fleet.test_committed_plans import LIMITS, PERIOD_S, ROUNDING_M
from touchline.coordination.free_area import FreeArea
from touchline.coordination.plans.committed_plans import CommittedPlans
from touchline.coordination.plans.geodesics import Geodesics
from touchline.coordination.plans.lanes import Lanes
from touchline.coordination.plans.legs import Leg, Manner
from touchline.coordination.plans.passages import find_passages

Floats = NDArray[np.float64]

APART_M = LIMITS.apart_m


def hall(width_m: float, length_m: float = 1.0) -> FreeArea:
    """A hall of 10 × 5 m, divided by a wall with a passage in its middle."""
    left, right, low, high = 5.0 - 0.5 * length_m, 5.0 + 0.5 * length_m, 2.5 - 0.5 * width_m, 2.5 + 0.5 * width_m
    walls = [[(left, y0), (right, y0), (right, y1), (left, y1)] for y0, y1 in ((0.0, low), (high, 5.0))]
    return FreeArea.of([(0, 0), (10, 0), (10, 5), (0, 5)], walls)


@pytest.mark.parametrize("length_m", [0.1, 1.0, 3.0])
@pytest.mark.parametrize("width_m", [0.6, 1.2, 2.4])
def test_a_passage_is_found_with_its_width_and_its_mouths(width_m: float, length_m: float) -> None:
    [passage] = find_passages(hall(width_m, length_m), APART_M)
    assert passage.width_m == pytest.approx(width_m, abs=0.02)
    mouths = sorted(passage.line[[0, -1]].real)
    assert mouths == pytest.approx([5.0 - 0.5 * length_m, 5.0 + 0.5 * length_m], abs=0.35)
    assert passage.line.imag == pytest.approx(2.5, abs=0.02)


_RIGHT = [(4, 0), (4, 1.4), (7.2, 1.4), (7.2, 5), (10, 5), (10, 9)]
_LEFT = [(3, 9), (3, 5), (6, 5), (6, 2.6), (4, 2.6), (4, 4), (0, 4)]
BENT = FreeArea.of([(0, 0), *_RIGHT, *_LEFT])
"""Two rooms, and an L-shaped corridor of 1.2 m between them."""


def test_a_passage_is_found_round_a_corner() -> None:
    [passage] = find_passages(BENT, APART_M)
    assert passage.width_m == pytest.approx(1.2, abs=0.02)
    assert sorted(passage.line[[0, -1]].real) == pytest.approx([4.0, 6.6], abs=0.1)


def test_neither_open_ground_nor_a_dead_end_nor_a_slit_is_a_passage() -> None:
    assert not find_passages(FreeArea.of([(0, 0), (5, 0), (5, 4), (0, 4)]), APART_M)
    assert not find_passages(FreeArea.of([(0, 0), (5, 0), (5, 2), (8, 2), (8, 3), (5, 3), (5, 5), (0, 5)]), APART_M)
    assert not find_passages(hall(0.35), APART_M)


def legs_of(area: FreeArea, places: list[complex], goals: list[complex]) -> list[Leg]:
    """Legs of robots."""
    lanes = Lanes(find_passages(area, APART_M), Geodesics(area, LIMITS.wall_m), APART_M)
    return lanes.legs(np.array(places), np.array(goals))


def test_robots_keep_to_the_right_of_a_passage_and_of_the_way_to_it() -> None:
    legs = legs_of(hall(1.2), [4.2 + 2.2j, 5.8 + 2.8j, 1 + 4j, 9 + 1j], [9 + 1j, 1 + 1j, 9 + 4j, 1 + 1j])
    assert [leg.manner for leg in legs] == [Manner.LANE] * 4
    assert [leg.aim.imag for leg in legs[:2]] == pytest.approx([2.2, 2.8], abs=0.01)
    assert legs[2].aim.imag < 2.0
    assert legs[3].aim.imag > 3.0


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


def through(area: FreeArea, starts: Floats, goals: Floats) -> float:
    """Time in which a team gets to its goals (s); plans keep apart and off walls."""
    team, now_s = CommittedPlans(starts, area, LIMITS), 0.0
    while np.abs(team.places - (goals[:, 0] + 1j * goals[:, 1])).max() > 0.1:
        assert now_s < 120.0, "somebody never arrives"
        team.update(goals)
        now_s += PERIOD_S
        assert team.closest_m >= LIMITS.apart_m - ROUNDING_M
        assert area.holds(team.plans[:, :, :2].reshape(-1, 2), LIMITS.wall_m - ROUNDING_M).all()
    return now_s


@pytest.mark.parametrize("width_m", [0.92, 1.2, 2.0])
def test_four_robots_on_each_side_of_a_passage_change_sides(width_m: float) -> None:
    y = np.array([0.8, 1.9, 3.0, 4.1])
    left, right = np.column_stack((np.full(4, 1.0), y)), np.column_stack((np.full(4, 9.0), y))
    starts = np.column_stack((np.concatenate((left, right)), np.repeat((0.0, math.pi), 4)))
    assert through(hall(width_m), starts, np.concatenate((right, left))) <= 25.0


def test_robots_meet_in_a_bent_corridor() -> None:
    below, above = [(1.0, 1.0), (2.0, 1.0), (1.0, 3.0)], [(4.0, 7.0), (8.0, 7.0), (8.0, 6.0)]
    starts = np.array([(x, y, 0.0) for x, y in below + above])
    assert through(BENT, starts, np.array(above + below)) <= 40.0
