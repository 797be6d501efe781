"""Whole jobs with receivers and nozzles that are not the usual ones, and one that is given up."""

import pytest

from touchline.schemas.messages import PlanOptions
from touchline.schemas.scenario import GnssNoise, Scenario
from touchline.schemas.template import Template
from touchline.schemas.vehicle import Vehicle
from touchline.services.runs.simulation import Job, simulate

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


def painted(vehicle: Vehicle | None = None, **scenario):
    job = Job.prepare(TEE, PlanOptions(), vehicle or Vehicle())
    return simulate(job, Scenario(seed=2, **scenario))


@pytest.mark.parametrize("gnss", [{"rate_hz": 1}, {"rate_hz": 2, "latency_s": 0.5}, {"latency_s": 0.5}])
def test_a_slow_or_late_receiver_is_no_reason_not_to_paint(gnss):
    outcome = painted(gnss=GnssNoise(**gnss))
    assert outcome.report.success, outcome.reason
    assert outcome.report.coverage_pct > 99.0
    assert outcome.report.lateral_error_max_m < 0.03


@pytest.mark.parametrize("ahead_m", [-0.3, 0.25])
def test_a_nozzle_before_or_behind_the_axle_paints_where_it_should(ahead_m):
    outcome = painted(Vehicle(nozzle_x_m=ahead_m), noise="none")
    assert outcome.report.success, outcome.reason
    assert outcome.report.coverage_pct > 99.0
    assert outcome.report.lateral_error_max_m < 0.01


def test_who_gives_up_a_simulation_is_told():
    blocked = [{"kind": "corrections-lost", "start_s": 0.0}]
    outcome = painted(gnss=GnssNoise(hold_s=0.0), faults=blocked)
    assert not outcome.report.success
    assert outcome.reason.startswith("given up by the simulation after 180 s without progress: ")
