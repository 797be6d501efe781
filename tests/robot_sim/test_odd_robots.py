"""Whole jobs with receivers and nozzles that are not the usual ones, and one that is given up."""

import pytest

from benchmarks._data_sheets import data_sheets
from touchline.jobs.single.simulation import Job, simulate
from touchline.schemas.errors import SpecError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import GnssNoise, Scenario
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator

TEE = Template.model_validate(
    {
        "name": "tee",
        "segments": [
            {"id": "bar", "line": {"start": [0, 0], "end": [4, 0]}},
            {"id": "left", "arc": {"start": [4, 0], "center": [4, 1.5], "sweep_angle": 1.5}},
            {"id": "right", "arc": {"start": [0, 2], "center": [0, 3.5], "sweep_angle": -2.0}},
        ],
    }
)


def painted(vehicle: Vehicle | None = None, config: OnboardConfig | None = None, **scenario):
    job = Job.prepare(TEE, PlanOptions(), vehicle or Vehicle())
    return simulate(job, Scenario(seed=2, **scenario), config)


def test_a_slow_and_late_receiver_is_no_reason_not_to_paint():
    receiver = GnssNoise(rate_hz=2, latency_s=0.5)
    with pytest.raises(SpecError, match=r"gnss\.rate_hz and gnss\.latency_s .* data sheet"):
        painted(gnss=receiver)
    outcome = painted(config=data_sheets(Scenario(gnss=receiver)), gnss=receiver)
    assert outcome.report.success, outcome.reason
    assert outcome.report.coverage_pct > 99.0
    assert outcome.report.lateral_error_max_m < 0.03


@pytest.mark.parametrize("ahead_m", [-0.3, 0.25])
def test_a_nozzle_before_or_behind_the_axle_paints_where_it_should(ahead_m):
    outcome = painted(Vehicle(tool={"nozzle_x_m": ahead_m}), noise="none")
    assert outcome.report.success, outcome.reason
    assert outcome.report.coverage_pct > 99.0
    assert outcome.report.lateral_error_max_m < 0.01


def test_who_gives_up_a_simulation_is_told():
    blocked = [{"kind": "corrections-lost", "start_s": 0.0}]
    outcome = painted(gnss=GnssNoise(hold_s=0.0), faults=blocked)
    assert not outcome.report.success
    assert outcome.reason.startswith("aborted by the simulation, in which nobody resumes: ")


def test_a_robot_that_was_told_wrong_of_its_receiver_believes_too_much_of_it():
    """Same world, same seed: only the data sheet differs."""
    world = Scenario(seed=2, gnss=GnssNoise(white_m=0.03, gauss_markov_1_m=0.02, gauss_markov_2_m=0.02))
    job, found = Job.prepare(TEE, PlanOptions()), []
    for config in (data_sheets(world), data_sheets(Scenario())):
        robot = Emulator(Vehicle(), world, config)
        robot.load(job.trajectory)
        robot.start()
        for _ in range(1500):
            robot.tick()
        found.append(robot.onboard.consistency)
    told_right, told_wrong = found
    assert told_wrong.position_sigma_m < 0.6 * told_right.position_sigma_m
