"""Two robots on one small field: painted once, kept apart, whatever happens to one of them."""

import random

import pytest

from tests.planner.drawn import drawn
from touchline.jobs.shared import shared_simulation
from touchline.jobs.shared.shared_job import APART_M, share_job
from touchline.jobs.shared.shared_simulation import simulate_shared
from touchline.jobs.shared.team_order import TeamOrder
from touchline.jobs.single.simulation import GivenDrive, Products, carry_out
from touchline.schemas.messages import PlanOptions
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.loaded_job import Taking

pytestmark = pytest.mark.xdist_group("shared lines")  # by one worker, so that they are planned and driven once
TEMPLATE = drawn(*((0.0, 4.0 * k, 12.0, 4.0 * k) for k in range(4)), (-1.0, 0.0, -1.0, 12.0), (6.0, 12.0, 6.0, 0.0))


@pytest.fixture(scope="module")
def job():
    return share_job(TEMPLATE, PlanOptions(), Vehicle(), [None] * 2)


def carried_out(job, seed=1, orders=()):
    return simulate_shared(job, [Setup().with_seed(seed + number) for number in range(2)], orders)


@pytest.fixture(scope="module")
def undisturbed(job):
    return carried_out(job)


def test_two_take_little_more_than_half_the_time_and_paint_everything_once(job, undisturbed):
    one, both = plan(TEMPLATE, Vehicle()), undisturbed
    assert both.reason == "" and both.total_time_s < 0.75 * one.report.total_time_s
    assert both.total_time_s == pytest.approx(job.table.end_s, rel=0.05)
    assert both.work.metrics.verdict.accepted and both.work.metrics.coverage_pct > 99.8
    assert both.work.metrics.double_paint_m2 < 0.005
    assert both.apart_m >= APART_M
    assert job.table.gates, "they do come into each other's way here"
    assert sum(len(own.report.segments) for (own,) in both.robots) == len(TEMPLATE.segments)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.full)])
def test_when_one_is_paused_they_keep_apart_and_paint_all_the_same(job, seed):
    chance = random.Random(seed)
    at_s, robot = chance.uniform(5.0, job.table.end_s), chance.randrange(2)
    both = carried_out(job, seed, [TeamOrder(at_s, robot, "pause"), TeamOrder(at_s + 30.0, robot, "resume")])
    assert both.reason == "" and both.apart_m >= APART_M
    assert both.work.metrics.coverage_pct > 99.8 and both.work.metrics.double_paint_m2 < 0.02


def test_when_one_fails_the_other_does_the_rest_on_command_and_all_once_it_is_carried_away(job):
    at_s, robot = 0.6 * job.table.end_s, 1
    orders = [TeamOrder(at_s, robot, "fail"), TeamOrder(at_s + 10.0, robot, "take-over")]
    both = carried_out(job, 5, orders)
    metrics = both.work.metrics
    assert both.reason == "" and both.apart_m >= APART_M
    assert len(both.robots[robot]) == 1 and len(both.robots[1 - robot]) == 2
    # What lies round the one that stands there cannot be reached; everything else is painted, and nothing twice.
    assert metrics.gap_m == pytest.approx(both.left_out.length_m, abs=0.1) and 0.0 < both.left_out.length_m < 4.0
    assert metrics.double_paint_m2 < 0.02 * TEMPLATE.line_width_m

    later_s = both.total_time_s + 5.0
    removed = [TeamOrder(later_s, robot, "remove"), TeamOrder(later_s, robot, "take-over")]
    after = carried_out(job, 5, [*orders, *removed])
    metrics = after.work.metrics
    assert after.reason == "" and not after.left_out and len(after.robots[1 - robot]) == 3
    assert metrics.coverage_pct > 99.8 and metrics.double_paint_m2 < 0.05 * TEMPLATE.line_width_m


def test_without_the_command_the_other_waits_where_it_is_safe_and_gives_up(monkeypatch, job):
    monkeypatch.setattr(shared_simulation, "PATIENCE_S", 45.0)
    both = carried_out(job, orders=[TeamOrder(6.0, 0, "fail")])
    assert "robot r1: out of service" in both.reason
    assert "robot r2: aborted by the simulation after 45 s" in both.reason
    assert both.apart_m >= APART_M and len(both.robots[1]) == 1


def test_robots_that_never_meet_have_the_hashes_that_each_would_have_alone():
    far = share_job(drawn((0, 0, 9, 0), (60, 0, 69, 0)), PlanOptions(), Vehicle(), [None] * 2)
    assert not far.table.gates
    setups = [Setup().with_seed(seed) for seed in (1, 2)]
    both = simulate_shared(far, setups, hashed=True)
    for (own,), setup, plan_, share in zip(both.robots, setups, far.plans, far.shares, strict=True):
        emulator = Emulator(setup.vehicle, setup.scenario, setup.onboard)
        alone = carry_out(emulator, GivenDrive(plan_.trajectory, share, Taking.CARRIED), Products(hashed=True))
        assert own.report.session_hash == alone.report.session_hash != ""
