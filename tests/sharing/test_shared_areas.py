"""Two rollers on one small pan: covered together, kept apart, whatever happens to one of them."""

import json
import math

import numpy as np
import pytest
import shapely

from touchline.checking.check_session import check_recording
from touchline.cli.choices import load_vehicle
from touchline.core.robust_overlay import as_area
from touchline.jobs.recording.payload_recorder import PayloadRecorder
from touchline.jobs.shared.assignment import AssignmentStatus, assignments
from touchline.jobs.shared.remaining_ground import RemainingGround
from touchline.jobs.shared.replanning import FieldRobot, replan_rest
from touchline.jobs.shared.shared_areas import share_areas
from touchline.jobs.shared.shared_job import APART_M
from touchline.jobs.shared.shared_simulation import simulate_shared
from touchline.jobs.shared.team_order import TeamOrder
from touchline.jobs.shared.team_report import team_figures
from touchline.jobs.shared.unfinished_lines import Standing
from touchline.onboard.interface import PaintBelief
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.setup import Setup
from touchline.schemas.template import Area, LineSpec, Polygon, Template, TemplateSegment

pytestmark = pytest.mark.xdist_group("shared areas")  # by one worker, so that what is shared is planned once

LONG_M, WIDE_M = 30.0, 20.0
CORNERS = ((0.0, 0.0), (LONG_M, 0.0), (LONG_M, WIDE_M), (0.0, WIDE_M))
PAN = Template(name="pan", areas=(Area(id="pan", outline=CORNERS),), boundary=Polygon(corners=CORNERS))
ROLLER = load_vehicle("clay-roller")


def box(x_m, y_m, long_m, wide_m):
    return ((x_m, y_m), (x_m + long_m, y_m), (x_m + long_m, y_m + wide_m), (x_m, y_m + wide_m))


PANS = Template(
    name="pans",
    areas=(Area(id="south", outline=box(0.0, 0.0, 10.0, 3.5)), Area(id="north", outline=box(0.0, 12.5, 10.0, 3.5))),
    boundary=Polygon(corners=box(-7.0, -7.0, 24.0, 30.0)),
)
QUICK = PlanOptions(coverage_pct=50.0)
NAMES = ["r1", "r2"]


@pytest.fixture(scope="module")
def job():
    return share_areas(PAN, QUICK, ROLLER, [None] * 2)


def carried_out(job, *orders, listener=None):
    setups = [Setup(vehicle=ROLLER).with_seed(1 + number) for number in range(2)]
    return simulate_shared(job, setups, orders, listener=listener)


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


def test_what_is_left_is_what_the_plans_up_to_where_robots_are_have_not_covered(job):
    def left_m2(*reached_m):
        told = [
            AssignmentStatus(each, PaintBelief((), (), 0.0), reached)
            for each, reached in zip(assignments(job), reached_m, strict=True)
        ]
        return RemainingGround().joined(job, told).figures["left_out_m2"]

    half_m = 0.5 * job.paths[0].end_m
    assert left_m2(0.0, 0.0) == pytest.approx(LONG_M * WIDE_M, rel=1e-3)
    assert left_m2(math.inf, math.inf) < 0.02 * LONG_M * WIDE_M
    assert left_m2(math.inf, 0.0) == pytest.approx(0.5 * LONG_M * WIDE_M, rel=0.1)
    assert left_m2(0.0, 0.0) > left_m2(half_m, 0.0) > left_m2(math.inf, 0.0)


def test_a_strip_that_nothing_can_be_driven_along_keeps_nobody_from_the_rest():
    job = share_areas(PANS, QUICK, ROLLER, [None] * 2)
    south, strip = (as_area(shapely.box(*corners)) for corners in ((0.0, 0.0, 10.0, 3.5), (0.0, 12.5, 1.2, 15.9)))
    left, painted = RemainingGround({"south": south, "north": strip}), np.zeros((0, 7))
    robot = FieldRobot(Standing("r2", (-3.0, 1.0, 0.0)), serves=True)
    with pytest.raises(PlanningError, match='the area "north", in which nothing is driven straight'):
        left.planned(job, [robot.place], [], painted, lambda done, what: None)
    rest = replan_rest(job, left, [robot], painted, lambda done, what: None)
    assert rest.crew == ("r2",) and [area.id for area in rest.job.shares[0].areas] == ["south"]
    assert rest.left_out.figures["left_out_m2"] == pytest.approx(strip.area)


@pytest.fixture(scope="module")
def taken_over(tmp_path_factory):
    """Two small pans, of which one roller leaves its own, and the other does that round it, and all once it is gone."""
    path = tmp_path_factory.mktemp("recorded") / "pans.mcap"
    job = share_areas(PANS, QUICK, ROLLER, [None] * 2)
    orders = [(8.0, "fail"), (11.0, "take-over"), (50.0, "remove"), (50.0, "take-over")]
    with PayloadRecorder(path, NAMES) as recorder:
        both = carried_out(job, *(TeamOrder(at_s, 0, kind) for at_s, kind in orders), listener=recorder.hear)
    assert recorder.figures()["complete"]
    return path, job, both


@pytest.mark.full
def test_the_other_covers_what_one_leaves_round_it_and_all_once_it_is_carried_away(taken_over):
    _, job, both = taken_over
    figures = team_figures(job, both, NAMES)
    json.dumps(figures)
    assert figures["success"] and all(order["done"] for order in figures["orders"])
    assert "m² cannot be reached" in figures["orders"][1]["outcome"]
    assert figures["traversal"]["left_out_m2"] == 0.0 and figures["traversal"]["closest_bodies_m"] >= APART_M
    area = figures["area"]
    assert area["body_outside_m"] == 0.0 and area["of_planned_pct"] > 99.9
    # Nothing is missed but what any plan leaves at corners, and it is what the plans that were driven have left.
    assert area["coverage_pct"] > 98.5 and max(patch["area_m2"] for patch in area["missed"]) < 1.0
    assert figures["plan"]["coverage_pct"] == pytest.approx(area["coverage_pct"], abs=0.2)
    assert [len(own) for own in both.robots] == [1, 3]
    assert all(each["area"]["coverage_pct"] > 0.0 for each in figures["robots"]["r2"]["taken_over"])


@pytest.mark.full
def test_what_was_taken_over_comes_out_the_same_again_from_its_recording(taken_over):
    path, _, _ = taken_over
    checks = check_recording(path)
    assert [(check.robot, check.problem, check.first) for check in checks] == [("r1", "", None), ("r2", "", None)]


def test_what_cannot_be_shared_is_refused():
    line = TemplateSegment(id="edge", line=LineSpec(start=(0.0, 0.0), end=(5.0, 0.0)))
    with pytest.raises(PlanningError, match='has the line "edge" beside its areas'):
        share_areas(PAN.model_copy(update={"segments": (line,)}), PlanOptions(), ROLLER, [None] * 2)
    with pytest.raises(PlanningError, match="has no area"):
        share_areas(Template(name="lines", segments=(line,)), PlanOptions(), ROLLER, [None] * 2)
    with pytest.raises(PlanningError, match="start or an end pose"):
        share_areas(PAN, PlanOptions(start=[0.0, 0.0, 0.0]), ROLLER, [None] * 2)
