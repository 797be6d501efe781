"""Areas through the planner's stages: from a template and a roller to a trajectory and its figures."""

import math

import numpy as np
import pytest

from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import LinearDirection, PlanOptions
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import CLAY_ROLLER
from touchline.services.planner.output.measure import gaps
from touchline.services.planner.plan import plan

pytestmark = pytest.mark.xdist_group("coverage")  # its kernels are compiled in one worker

FIELD = {"outline": ((0.0, 0.0), (60.0, 0.0), (60.0, 13.2), (0.0, 13.2)), "id": "pan"}
LINE = {"id": "line", "line": {"start": (0.0, 0.0), "end": (5.0, 0.0)}}
ZIGZAG = PlanOptions(area_method="zigzag")


def template(**things: object) -> Template:
    return Template.model_validate({"name": "field", "areas": [FIELD], **things})


def test_a_field_is_rolled_lane_by_lane_and_reported() -> None:
    planned = plan(template(), CLAY_ROLLER, ZIGZAG)
    segments = planned.trajectory.path.segments
    assert len({segment.id for segment in segments}) == len(segments)
    ways = {segment.id: segment.direction.value for segment in segments if template().area_of(segment.id)}
    assert list(ways) == [f"pan#{number}" for number in range(1, 7)]
    assert list(ways.values()) == [LinearDirection.FORWARD, LinearDirection.BACKWARD] * 3
    position_m, heading_rad = gaps(planned.trajectory)
    assert position_m < 1e-9
    assert heading_rad < 1e-9
    speeds = planned.speeds
    assert np.count_nonzero(speeds.speed_mps[1:-1] == 0.0) == planned.report.cusps == 5
    assert speeds.speed_mps.max() == pytest.approx(1.0)
    assert planned.report.paint_l == 0.0
    (figures,) = planned.report.coverage
    assert (figures.method, figures.lanes) == ("zigzag", 6)
    assert figures.area_m2 == pytest.approx(60.0 * 13.2)
    assert figures.covered_m2 + sum(patch.area_m2 for patch in figures.missed) == pytest.approx(792.0, abs=0.5)
    assert figures.coverage_pct == pytest.approx(100.0 * figures.covered_m2 / figures.area_m2)
    assert figures.body_outside_m == pytest.approx(2.5, abs=0.1)
    assert any("body is ignored" in note for note in figures.notes)


def test_a_method_may_name_an_area_method() -> None:
    named = plan(template(), CLAY_ROLLER, PlanOptions(method="zigzag"))
    assert named.trajectory == plan(template(), CLAY_ROLLER, ZIGZAG).trajectory


def test_the_area_says_the_angle_and_the_options_before_it() -> None:
    turned = template(areas=[{**FIELD, "angle_deg": 90.0}])
    assert plan(turned, CLAY_ROLLER, ZIGZAG).report.coverage[0].swath_angle_deg == pytest.approx(90.0)
    asked = ZIGZAG.model_copy(update={"swath_angle_deg": np.array([0.0])})
    assert plan(turned, CLAY_ROLLER, asked).report.coverage[0].swath_angle_deg == pytest.approx(0.0)


def test_a_roller_along_lines_is_planned_as_lines() -> None:
    lines = Template.model_validate(
        {"name": "lines", "segments": [{**LINE, "line": {"start": (0, 0), "end": (20, 0)}}]}
    )
    planned = plan(lines, CLAY_ROLLER, PlanOptions(forward_only=True))
    assert [s.id for s in planned.trajectory.path.segments if s.id == "line"] == ["line"]
    assert not planned.report.coverage


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"overlap_m": -0.1}, "overlap_m"),
        ({"overlap_m": 2.2}, "overlap_m"),
        ({"margin_m": math.nan}, "margin_m"),
        ({"laps": 1000}, "laps"),
        ({"coverage_pct": 101.0}, "coverage_pct"),
        ({"swath_angle_deg": np.array([720.0])}, "swath_angle_deg"),
        ({"area_method": "spiral"}, "spiral"),
        ({"return_to_start": True}, "return to its start"),
        ({"start": np.zeros(3)}, "a start pose"),
        ({"order": "given"}, "the given order"),
        ({"forward_only": True}, "forward only"),
    ],
)
def test_options_out_of_range_are_named(changes: dict[str, object], named: str) -> None:
    with pytest.raises(PlanningError, match=named):
        plan(template(), CLAY_ROLLER, ZIGZAG.model_copy(update=changes))


def test_lines_beside_areas_and_a_sprayer_are_refused() -> None:
    with pytest.raises(PlanningError, match="1 lines beside its areas"):
        plan(template(segments=[LINE]), CLAY_ROLLER, ZIGZAG)
    with pytest.raises(PlanningError, match="use parallel, or a vehicle with a roller"):
        plan(template(), Vehicle(), ZIGZAG)
