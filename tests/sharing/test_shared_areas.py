"""Two rollers on one small pan: covered together, kept apart, whatever happens to one of them."""

import json

import pytest

from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.setup import Setup
from touchline.schemas.template import Area, LineSpec, Polygon, Template, TemplateSegment
from touchline.services.cli.choices import load_vehicle
from touchline.services.runs.sharing.shared_areas import share_areas
from touchline.services.runs.sharing.shared_job import APART_M
from touchline.services.runs.sharing.shared_simulation import simulate_shared
from touchline.services.runs.sharing.team_order import TeamOrder
from touchline.services.runs.sharing.team_report import team_figures

LONG_M, WIDE_M = 30.0, 20.0
CORNERS = ((0.0, 0.0), (LONG_M, 0.0), (LONG_M, WIDE_M), (0.0, WIDE_M))
PAN = Template(name="pan", areas=(Area(id="pan", outline=CORNERS),), boundary=Polygon(corners=CORNERS))
ROLLER = load_vehicle("clay-roller")
QUICK = PlanOptions(coverage_pct=50.0)
NAMES = ["r1", "r2"]


@pytest.fixture(scope="module")
def job():
    return share_areas(PAN, QUICK, ROLLER, 2)


def carried_out(job, *orders):
    return simulate_shared(job, [Setup(vehicle=ROLLER).with_seed(1 + number) for number in range(2)], orders)


def test_one_is_paused_and_they_cover_as_much_as_was_planned_and_keep_apart(job):
    both = carried_out(job, TeamOrder(40.0, 0, "pause"), TeamOrder(70.0, 0, "resume"))
    figures = team_figures(job, both, NAMES)
    json.dumps(figures)
    assert figures["success"] and all(order["done"] for order in figures["orders"])
    assert figures["traversal"]["closest_bodies_m"] >= APART_M
    assert job.table.end_s - 5.0 < figures["traversal"]["total_time_s"] < job.table.end_s + 60.0
    # By both together, of the whole pan: more than either has done of it.
    area, own = figures["area"], [figures["robots"][name]["area"] for name in NAMES]
    assert area["area_m2"] == pytest.approx(LONG_M * WIDE_M)
    assert area["of_planned_pct"] > 99.0
    assert area["coverage_pct"] == pytest.approx(figures["plan"]["coverage_pct"], abs=1.5)
    assert max(each["covered_m2"] for each in own) < 0.75 * area["covered_m2"] <= sum(e["covered_m2"] for e in own)


def test_when_one_fails_the_report_says_what_is_not_covered_and_a_take_over_is_declined(job):
    both = carried_out(job, TeamOrder(30.0, 1, "fail"), TeamOrder(31.0, 1, "take-over"))
    figures = team_figures(job, both, NAMES)
    assert not figures["success"] and "robot r2: out of service" in figures["reason"]
    assert figures["traversal"]["closest_bodies_m"] >= APART_M
    assert figures["area"]["missed_m2"] > 0.3 * LONG_M * WIDE_M and figures["area"]["missed"]
    assert not figures["orders"][1]["done"] and "only lines are taken over" in figures["orders"][1]["outcome"]


def test_what_cannot_be_shared_is_refused():
    line = TemplateSegment(id="edge", line=LineSpec(start=(0.0, 0.0), end=(5.0, 0.0)))
    with pytest.raises(PlanningError, match='has the line "edge" beside its areas'):
        share_areas(PAN.model_copy(update={"segments": (line,)}), PlanOptions(), ROLLER, 2)
    with pytest.raises(PlanningError, match="has no area"):
        share_areas(Template(name="lines", segments=(line,)), PlanOptions(), ROLLER, 2)
    with pytest.raises(PlanningError, match="start or an end pose"):
        share_areas(PAN, PlanOptions(start=[0.0, 0.0, 0.0]), ROLLER, 2)
