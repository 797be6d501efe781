"""A whole roller on a small pan: what it tells of the area, and that it does not matter how its ticks are run."""

import pytest

from touchline.jobs.single.reports import work_report
from touchline.schemas import messages as m
from touchline.schemas import topics
from touchline.schemas.cdr import decode
from touchline.schemas.messages import PlanOptions, PlanReport
from touchline.schemas.onboard import OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Area, Polygon, Template
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import CLAY_ROLLER
from touchline.services.planner.plan import plan
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.fast_runner import FastRunner
from touchline.services.robot_sim.recovery_state import EarlierWork
from touchline.services.robot_sim.telemetry import Telemetry

pytestmark = pytest.mark.xdist_group("roller")  # its kernels are compiled in one worker

CORNERS = ((0.0, 0.0), (7.0, 0.0), (7.0, 4.2), (0.0, 4.2))
ROOM = ((-9.0, -9.0), (16.0, -9.0), (16.0, 13.0), (-9.0, 13.0))
PAN = Template(
    name="pan", areas=(Area(id="pan", outline=CORNERS, angle_deg=0.0),), boundary=Polygon(id="room", corners=ROOM)
)
CONFIG = OnboardConfig(follower="pure-pursuit")


@pytest.fixture(scope="module")
def trajectory():
    return plan(PAN, CLAY_ROLLER, PlanOptions(order="given", area_method="parallel")).trajectory


def robot():
    emulator = Emulator(CLAY_ROLLER, Scenario(seed=2, ground={"surface": "clay"}), CONFIG)
    return emulator, Telemetry(emulator)


ONE_BY_ONE = 300
"""Ticks."""


def session(trajectory, *, slow_blocks):
    """All that is said; `slow_blocks` of every nine blocks of ONE_BY_ONE ticks are driven tick by tick."""
    emulator, telemetry = robot()
    emulator.load(trajectory, PAN)
    said = telemetry.loaded(trajectory, PAN)
    emulator.start()
    runner = FastRunner(emulator)
    while emulator.active:
        if emulator.tick_count // ONE_BY_ONE % 9 >= slow_blocks:
            said += telemetry.after(
                runner.step(telemetry.until_due(ONE_BY_ONE - emulator.tick_count % ONE_BY_ONE), telemetry.rows)
            )
        else:
            emulator.tick()
            said += telemetry.after_tick()
    return telemetry, said


@pytest.fixture(scope="module")
def driven(trajectory):
    return session(trajectory, slow_blocks=0)


def of(said, topic):
    return [decode(topic.type, payload) for told, payload in said if told is topic]


def test_it_tells_of_the_area_while_it_works_and_in_the_end(driven):
    telemetry, said = driven
    live, (report,) = of(said, topics.AREA), of(said, topics.AREA_REPORT)
    covered = [each.coverage_pct for each in live]
    assert covered == sorted(covered) and covered[0] < 5.0
    assert len(live) >= of(said, topics.REPORT)[0].total_time_s
    assert report.area_m2 == pytest.approx(7.0 * 4.2)
    assert live[-1].covered_m2 == pytest.approx(report.covered_m2, rel=0.005)
    assert live[-1].overlap_m2 == pytest.approx(report.overlap_m2, abs=0.5)
    assert report.coverage_pct > 99.5 and report.of_planned_pct > 99.5
    assert report.body_outside_m == 0.0 and report.lateral_error_p95_m < 0.06
    truth = of(said, topics.TRUE_COVERAGE)[-1]
    assert truth.painted_ids == ("pan",)
    assert truth.coverage_pct == pytest.approx(live[-1].coverage_pct)
    assert truth.painted_fraction.tolist() == [pytest.approx(live[-1].coverage_pct / 100.0)]
    assert [topic for topic, _ in said[-2:]] == [topics.AREA_REPORT, topics.REPORT]
    final = telemetry.final
    assert final.traversal.success and final.traversal.session_hash
    assert final.traversal.verdict.endswith("of what the plan covers is covered, 99 % is asked for")
    figures = work_report(final.traversal, final.area, PlanReport())
    assert set(figures) == {"area", "estimator"}
    assert figures["area"]["coverage_pct"] == final.traversal.coverage_pct


def test_ticks_one_by_one_say_the_same(driven, trajectory):
    _, said = session(trajectory, slow_blocks=1)
    assert said == driven[1]


def test_another_process_goes_on_and_has_the_figures_of_both(driven, trajectory):
    before, _ = robot()
    before.load(trajectory, PAN)
    before.start()
    while before.onboard.status.arc_length_m < 0.4 * before.onboard.status.total_length_m:
        before.tick()
    checkpoint, totals = before.onboard.checkpoint, before.totals
    after, telemetry = robot()
    after.load(trajectory, PAN, checkpoint, EarlierWork(totals, before.work.ledger.rows(0)[: totals.points]))
    telemetry.restored_paint()
    telemetry.standing()
    before_m2 = after.work.account.standing.covered_m2
    after.start()
    FastRunner(after).run(100_000)
    assert after.onboard.state == m.TraversalStatus.DONE
    telemetry.standing()
    assert 6.0 < before_m2 < 25.0
    reports = telemetry.reports()
    assert reports.area.coverage_pct == pytest.approx(driven[0].final.area.coverage_pct, abs=0.3)
    assert after.work.account.standing.covered_m2 == pytest.approx(reports.area.covered_m2, rel=0.005)


def test_who_does_not_cover_areas_says_nothing_of_them(trajectory):
    painter = Emulator(Vehicle(), Scenario())
    painter.load(plan(PAN, Vehicle(), PlanOptions(order="given", area_method="parallel")).trajectory, PAN)
    assert painter.work.account is None
    emulator, telemetry = robot()
    emulator.load(trajectory)
    assert emulator.work.account is None
    assert telemetry.reports().area is None
