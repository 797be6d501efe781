"""Plans with cusps and turns on the spot, driven and painted by the emulated robot."""

import pytest

from tests.planner.test_standing import there_and_back
from touchline.schemas.catalogue import load_template
from touchline.schemas.messages import LinearDirection, PlanOptions
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import Plan, plan
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.paint.metrics import PaintMetrics, paint_metrics

VEHICLE = Vehicle()
STEPS_MAX = 20_000


def painted(planned: Plan, template: Template, config: OnboardConfig) -> PaintMetrics:
    robot = Emulator(VEHICLE, Scenario(seed=3), config)
    robot.load(planned.trajectory, template)
    robot.start()
    FastRunner(robot).run(STEPS_MAX)
    assert not robot.active
    return paint_metrics(robot.work.ledger)


@pytest.mark.parametrize("follower", ["mpc", pytest.param("pure-pursuit", marks=pytest.mark.full)])
def test_what_is_planned_with_standstills_is_painted_as_well_as_without(follower: str) -> None:
    config = OnboardConfig.model_validate({"follower": follower})
    spinning = VEHICLE.changed(drive={"can_reverse": False}, tool={"paint_speed_mps": 0.5})
    for template, vehicle in ((load_template("study-square"), VEHICLE), (there_and_back(), spinning)):
        standing = plan(template, vehicle)
        forward = plan(template, vehicle, PlanOptions(forward_only=True))
        assert standing.report.total_time_s < forward.report.total_time_s
        directions = {s.direction.value for s in standing.trajectory.path.segments}
        assert directions & {LinearDirection.BACKWARD, LinearDirection.NONE}
        ours, theirs = painted(standing, template, config), painted(forward, template, config)
        assert ours.gap_m <= theirs.gap_m + 0.01
        assert ours.lateral.p95_m <= theirs.lateral.p95_m + 8e-3
