"""Two robots share a template over the bus: each is told how far it may drive by what the other one reports."""

import pytest

from tests.sharing.test_shared_simulation import GRID, TEMPLATE
from touchline.schemas import topics
from touchline.schemas.messages import AuthorizeRequest, PlanOptions
from touchline.schemas.setup import Setup
from touchline.schemas.vehicles import Vehicle
from touchline.services.runs.sharing.joint_paint import paint_of_strokes
from touchline.services.runs.sharing.shared_bus_run import SharedBusRun
from touchline.services.runs.sharing.shared_job import share_job
from touchline.services.system.temporary_system import local_system


class Silent:
    def stage(self, text): ...
    def progress(self, fraction, text): ...
    def event(self, severity, text): ...
    def check(self): ...


@pytest.mark.xdist_group("shared-run")
def test_two_robots_paint_a_template_over_the_bus():
    job = share_job(TEMPLATE, PlanOptions(), Vehicle(), [None] * 2)
    setups = {f"r{number + 1}": Setup().with_seed(number + 1) for number in range(2)}
    with local_system(setups) as system:
        system.wait_until_ready(lambda text: None)
        nan = AuthorizeRequest(request_id="a", until_m=float("nan"))
        assert "give an arc length" in system.bus.call(topics.AUTHORIZE, nan).message
        early = AuthorizeRequest(request_id="b", until_m=1.0)
        assert "no trajectory is loaded" in system.bus.call(topics.AUTHORIZE, early).message
        run = SharedBusRun(system.buses, job, -1.0, Silent())
        run.run()
    assert [report.success for report in run.reports] == [True, True]
    painted = {stroke.segment_id for own in run.strokes for stroke in own if stroke.segment_id}
    assert painted == set(GRID)
    paint = paint_of_strokes(TEMPLATE, Vehicle(), [stroke for own in run.strokes for stroke in own])
    assert paint.metrics.verdict.accepted and paint.metrics.coverage_pct > 99.8
    assert paint.metrics.double_paint_m2 < 0.005
