"""Soft tyres on wet grass are a lag that no data sheet has: the followers keep their course all the same."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.onboard.rig import chain, trajectory
from tests.with_full import with_full
from touchline.schemas.messages import PlanOptions, TraversalStatus
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import LineSpec, Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import Plan, plan
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.paint.metrics import paint_metrics


@pytest.mark.parametrize("follower", with_full("mpc", full=("pure-pursuit",)))
@pytest.mark.parametrize("surface", ["wet-grass", pytest.param("grass", marks=pytest.mark.full)])
def test_no_limit_cycle_on_a_straight_at_transit_speed(follower: str, surface: str) -> None:
    emulator = Emulator(Vehicle(), Scenario(seed=1, ground={"surface": surface}), OnboardConfig(follower=follower))
    emulator.load(trajectory(chain((0.0, 30.0)), speed=1.4))
    emulator.start()
    lateral, apart = [], []
    while emulator.active and emulator.time_s < 20.0:
        emulator.tick()
        if emulator.onboard.state == TraversalStatus.RUNNING and emulator.time_s > 5.0:
            lateral.append(abs(emulator.onboard.lateral_error_m))
            apart.append(emulator.command.actuators[1] - emulator.command.actuators[0])
    assert emulator.onboard.status.arc_length_m > 19.0
    assert np.percentile(lateral, 95) < 0.006
    assert np.std(np.diff(apart)) < 0.15


CORNER = Template(
    name="corner",
    title="Corner",
    segments=(
        TemplateSegment(id="a", line=LineSpec(start=(0.0, 0.0), end=(3.0, 0.0)), actuation="SPRAY"),
        TemplateSegment(id="b", line=LineSpec(start=(3.0, 0.0), end=(3.0, 3.0)), actuation="SPRAY"),
    ),
)


@cache
def corner() -> Plan:
    return plan(CORNER, Vehicle(), PlanOptions())


@pytest.mark.parametrize("follower", with_full("mpc", full=("pure-pursuit",)))
@pytest.mark.parametrize("seed", with_full(1, full=(2, 3)))
def test_a_plan_for_dry_grass_is_driven_to_the_end_of_the_grip(follower: str, seed: int) -> None:
    """Wheels at the end of their grip are not sped up until they spin, and what they slip is known."""
    emulator = Emulator(
        Vehicle(), Scenario(seed=seed, ground={"surface": "wet-grass"}), OnboardConfig(follower=follower)
    )
    emulator.load(corner().trajectory, CORNER)
    emulator.start()
    worst = 0.0
    while emulator.active and emulator.time_s < 60.0:
        emulator.tick()
        state = emulator.world.state
        beneath = state.speed_mps + np.array((-0.5, 0.5)) * Vehicle().drive.track_width_m * state.yaw_rate_radps
        slid = Vehicle().drive.wheel_radius_m * emulator.world.drive.rate_radps - beneath
        worst = max(worst, float(np.abs(slid).max()))
    assert worst > 0.1  # the plan asks for all of the grip
    assert emulator.onboard.state == TraversalStatus.DONE
    assert [event.text for event in emulator.take_events() if event.severity] == []
    metrics = paint_metrics(emulator.work.ledger)
    assert metrics.gap_m < 0.03  # four ends of lines, some millimetres each
    assert metrics.lateral.p95_m < 0.025
    assert emulator.onboard.status.follower_fallbacks == 0
