"""Random goals, and others every 2 to 5 s on the way: the robots get there, and nothing jumps when one takes over."""

import math

import numpy as np
import pytest

from benchmarks._goal_chain import GoalChain
from tests.with_full import with_full
from touchline.schemas.vehicles.shipped import SHIPPED

pytestmark = pytest.mark.xdist_group("small robots")  # its kernels are compiled in one worker


@pytest.mark.parametrize("vehicle", with_full("turtlebot3-waffle-pi", full=("turtlebot2", "turf-tank-two")))
def test_goals_that_replace_each_other_are_reached(vehicle):
    chain = GoalChain(vehicle, SHIPPED[vehicle].follower, np.random.default_rng(4))
    for others in (0, 2, 3):
        chain.drive(others)
    assert len(chain.ends) == 3
    assert chain.taken >= 4, chain.refused
    for off_m, turned, late_s in chain.ends:
        assert off_m < 0.02
        assert turned < math.radians(2.0)
        assert abs(late_s) < 1.5
    largest = np.max(chain.jumps, axis=0)
    assert largest[0] < 2e-3
    assert largest[1] < math.radians(1.0)
    assert largest[2] < 0.05
    assert chain.wheel_share <= 1.0 + 1e-6
    assert chain.commanded_share <= 1.0 + 1e-6
