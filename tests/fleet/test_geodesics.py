"""Ways round walls: as long as they must be, hardly longer, and each next point is seen."""

import math

import numpy as np
import pytest

from touchline.coordination.free_area import FreeArea
from touchline.coordination.geodesics import Geodesics

WALL_M = 0.2
ROOM = FreeArea.of([(0, 0), (6, 0), (6, 6), (0, 6)], [[(2.8, 0), (3.2, 0), (3.2, 4.5), (2.8, 4.5)]])
GOAL = 5 + 1j


def test_a_way_leads_round_a_wall_and_is_hardly_longer_than_it_must_be() -> None:
    ways, place, driven_m = Geodesics(ROOM, WALL_M), 1 + 1j, 0.0
    _, length_m = ways.way(place, GOAL)
    for _ in range(200):
        aim, _ = ways.way(place, GOAL)
        step = (aim - place) / max(abs(aim - place), 0.1) * 0.1
        place, driven_m = place + step, driven_m + abs(step)
        assert ROOM.holds(np.array([(place.real, place.imag)]), WALL_M - 2e-3).all()
        if abs(place - GOAL) < 0.05:
            break
    else:
        pytest.fail("it never arrives")
    corners = (abs(2.8 - 0.2 + 4.5j - (1 + 1j)), math.pi / 2 * 0.2, 0.4, math.pi / 2 * 0.2)
    least_m = sum(corners) - 0.4 + abs(3.4 + 4.5j - GOAL)  # tangents to the two corners are shorter than to their discs
    assert least_m - 0.2 <= driven_m <= 1.06 * least_m
    assert length_m == pytest.approx(driven_m, rel=0.05)


def test_a_goal_that_is_seen_or_that_no_way_leads_to_is_driven_at() -> None:
    ways = Geodesics(ROOM, WALL_M)
    aim, length_m = ways.way(1 + 1j, 2 + 5j)
    assert aim == 2 + 5j
    assert length_m == pytest.approx(abs(1 + 4j))
    closed = FreeArea.of([(0, 0), (6, 0), (6, 6), (0, 6)], [[(2.8, 0), (3.2, 0), (3.2, 5.7), (2.8, 5.7)]])
    assert Geodesics(closed, WALL_M).way(1 + 1j, GOAL)[0] == GOAL
