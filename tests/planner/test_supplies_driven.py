"""Paint and battery that a plan claims to take, against those that the emulated robot takes."""

import pytest

from touchline.schemas.catalogue import load_template
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner

SLICE_TICKS = 10_000


@pytest.mark.parametrize("tank_l", [1.3, pytest.param(20.0, marks=pytest.mark.full)])
def test_a_job_takes_what_its_plan_says(tank_l: float) -> None:
    """With a tank that the job all but empties the robot loses 38 of its 100 kg on the way."""
    vehicle, template = Vehicle(tool={"tank_l": tank_l}), load_template("tennis")
    planned = plan(template, vehicle)
    robot = Emulator(vehicle, Scenario(seed=1))
    before_l, before_wh, *_ = robot.world.supplies
    robot.load(planned.trajectory, template)
    robot.start()
    runner = FastRunner(robot)
    while robot.active:
        runner.run(SLICE_TICKS)
    after_l, after_wh, *_ = robot.world.supplies
    assert planned.report.paint_l == pytest.approx(before_l - after_l, rel=0.01)
    assert planned.report.battery_wh == pytest.approx(before_wh - after_wh, rel=0.03)
