"""Soft tyres on wet grass are a lag that no data sheet has: the followers keep their course all the same."""

from __future__ import annotations

import numpy as np
import pytest

from schemas.messages import TraversalStatus
from schemas.scenario import Scenario
from schemas.vehicle import Vehicle
from services.robot_sim.emulator import Emulator
from tests.robot_sim.onboard.rig import chain, trajectory


@pytest.mark.parametrize("follower", ["mpc", "pure-pursuit"])
@pytest.mark.parametrize("surface", ["grass", "wet-grass"])
def test_no_limit_cycle_on_a_straight_at_transit_speed(follower: str, surface: str) -> None:
    emulator = Emulator(Vehicle(), Scenario(seed=1, follower=follower, ground={"surface": surface}))
    emulator.load(trajectory(chain((0.0, 30.0)), speed=1.4))
    emulator.start()
    lateral, apart = [], []
    while emulator.active and emulator.time_s < 20.0:
        emulator.tick()
        if emulator.onboard.state == TraversalStatus.RUNNING and emulator.time_s > 5.0:
            lateral.append(abs(emulator.onboard.lateral_error_m))
            apart.append(emulator.command.right_radps - emulator.command.left_radps)
    assert emulator.onboard.status.arc_length_m > 19.0
    assert np.percentile(lateral, 95) < 0.006
    assert np.std(np.diff(apart)) < 0.15
