"""Two markers on a soccer pitch: little more than half of one's time, drier than one, and never near each other."""

import pytest

from touchline.jobs.shared.shared_job import APART_M, share_job
from touchline.jobs.shared.shared_simulation import simulate_shared
from touchline.schemas.catalogue import load_template
from touchline.schemas.messages import PlanOptions
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.plan import plan


@pytest.mark.full
def test_two_markers_on_a_soccer_pitch():
    template = load_template("soccer-7", {})
    one = plan(template, Vehicle()).report
    job = share_job(template, PlanOptions(), Vehicle(), [None] * 2)
    both = simulate_shared(job, [Setup().with_seed(seed) for seed in (1, 2)])
    assert both.reason == "" and both.total_time_s <= 0.6 * one.total_time_s
    assert both.work.metrics.coverage_pct >= 99.9 and both.work.metrics.double_paint_m2 < 0.001
    assert job.wet_crossings <= one.wet_crossings and both.work.wet_crossings <= one.wet_crossings
    assert both.apart_m >= APART_M
