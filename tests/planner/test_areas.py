"""Areas: swaths cover all of them and leave them by no more than is said; they plan and drive like lines."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st
from typer.testing import CliRunner

from tests.command import app
from tests.planner.strategies import floats
from touchline.jobs.single.simulation import Job, simulate
from touchline.schemas.catalogue import parse_template, placed
from touchline.schemas.curves import Curve
from touchline.schemas.errors import PlanningError, SpecError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.plugins import AREA_METHODS
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Area, LineSpec, Placement, Template, TemplateSegment
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.coverage.parallel import SHORTEST_M, parallel
from touchline.services.planner.plan import plan
from touchline.services.robot_sim.paint.targets import targets

WIDTH_M = Vehicle().tool.spray_width_m


def star(radii: Sequence[float], x: float, y: float) -> list[tuple[float, float]]:
    """A simple polygon round a point, with bays and points."""
    angles = np.arange(len(radii)) * math.tau / len(radii)
    return [(x + r * math.cos(a), y + r * math.sin(a)) for r, a in zip(radii, angles, strict=True)]


@st.composite
def areas(draw: st.DrawFn) -> Area:
    outline = star(draw(st.lists(floats(0.8, 4.0), min_size=3, max_size=9)), draw(floats(-50, 50)), draw(floats(-9, 9)))
    middle = shapely.Polygon(outline).representative_point()
    holes = [star(draw(st.lists(floats(0.05, 0.4), min_size=3, max_size=6)), middle.x, middle.y)]
    inside = shapely.Polygon(outline).contains_properly(shapely.Polygon(holes[0]))
    return Area(
        id="lawn",
        outline=tuple(outline),
        holes=tuple(map(tuple, holes)) if inside and draw(st.booleans()) else (),
        angle_deg=draw(st.none() | floats(-360, 360)),
    )


def band(swath: Curve, width_m: float) -> shapely.Polygon:
    line = shapely.LineString([(swath.x_m, swath.y_m), swath.end[:2]])
    return line.buffer(0.5 * width_m, cap_style="flat")


@given(areas(), floats(0.08, 0.7))
def test_swaths_cover_an_area_and_keep_to_it(area: Area, width_m: float) -> None:
    polygon = shapely.Polygon(area.outline, area.holes)
    assume(not polygon.buffer(-0.5 * width_m).is_empty)
    swaths = parallel(area, width_m)
    covered = shapely.union_all([band(swath, width_m) for swath in swaths])
    assert polygon.difference(covered).area <= 1e-3 * polygon.area
    beyond = covered.difference(polygon.buffer(width_m + 0.5 * SHORTEST_M + 1e-3, quad_segs=64))
    assert beyond.area <= 1e-9
    for swath in swaths:
        line = shapely.LineString([(swath.x_m, swath.y_m), swath.end[:2]])
        assert swath.length_m >= SHORTEST_M - 1e-9
        if swath.length_m > SHORTEST_M + 1e-6:
            assert line.difference(polygon.buffer(0.5 * width_m + 1e-3, quad_segs=64)).length <= 1e-9
        if area.angle_deg is not None:
            assert abs(math.sin(swath.heading_rad - math.radians(area.angle_deg))) < 1e-6


def box(width_m: float, height_m: float, **others: object) -> Area:
    corners = ((0, 0), (width_m, 0), (width_m, height_m), (0, height_m))
    return Area.model_validate({"id": "lawn", "outline": corners, **others})


def test_a_rectangle_takes_as_few_swaths_as_fit_along_its_longer_side_there_and_back() -> None:
    swaths = parallel(box(3.0, 0.6), WIDTH_M)
    assert len(swaths) == 5
    assert [round(swath.y_m, 6) for swath in swaths] == [0.06, 0.18, 0.3, 0.42, 0.54]
    assert [round(math.cos(swath.heading_rad)) for swath in swaths] == [1, -1, 1, -1, 1]
    assert all(swath.length_m == pytest.approx(3.0) for swath in swaths)
    assert len(parallel(box(3.0, 0.6, angle_deg=90.0), WIDTH_M)) == 25


def test_a_hole_parts_the_swaths_that_meet_it() -> None:
    hole = [(1, 0.3), (2, 0.3), (2, 0.9), (1, 0.9)]
    swaths = parallel(box(3.0, 1.2, holes=[hole], angle_deg=0.0), WIDTH_M)
    lengths = sorted(round(swath.length_m, 6) for swath in swaths)
    # Of ten rows four lie wholly within the hole's height, and two are half beside it: all of those is painted.
    assert lengths == [1.0] * 8 + [3.0] * 6


def lawn(**others: object) -> Template:
    """A line, and an area with a hole beside it."""
    line = TemplateSegment(id="edge", line=LineSpec(start=(0.0, 3.0), end=(6.0, 3.0)))
    hole = [(1.0, 0.3), (1.5, 0.3), (1.5, 0.6), (1.0, 0.6)]
    return Template(name="lawn", segments=(line,), areas=(box(4.0, 0.9, holes=[hole], **others),))


def test_a_template_with_an_area_and_a_line_is_painted() -> None:
    job = Job.prepare(lawn(), PlanOptions())
    outcome = simulate(job, Scenario())
    assert outcome.report.success
    assert outcome.report.coverage_pct > 99.0
    ids = {segment.id for segment in outcome.report.segments}
    names = {"edge", *(f"lawn#{k}" for k in range(1, len(ids)))}
    assert ids == names
    assert len(ids) == 1 + len(parallel(lawn().areas[0], WIDTH_M))
    assert all(segment.coverage_pct > 95.0 for segment in outcome.report.segments)


def test_a_plan_that_has_no_swath_of_an_area_cannot_be_judged_by_it() -> None:
    without = Job.prepare(lawn().model_copy(update={"areas": ()}), PlanOptions())
    with pytest.raises(ValueError, match='no swath of the area "lawn"'):
        targets(without.trajectory, lawn(), Vehicle())


def lanes(area: Area, width_m: float) -> list[Curve]:
    """An area method of somebody else: rows over the box round the area, and a bend for good measure."""
    left, low, right, high = shapely.Polygon(area.outline).bounds
    rows = np.arange(low + 0.5 * width_m, high, width_m).tolist()
    bend = Curve.from_arc((left, low), (left, low + 2.0), 1.0)
    return [*(Curve.from_line((left, y), (right, y)) for y in rows), bend]


@pytest.fixture
def newcomer() -> Iterator[str]:
    AREA_METHODS.register("lanes", "rows over the box", lanes)
    yield "lanes"
    AREA_METHODS.forget("lanes")


def test_another_area_method_plans(newcomer: str) -> None:
    job = Job.prepare(lawn(), PlanOptions(area_method=newcomer))
    assert {segment.id for segment in job.trajectory.path.segments} >= {"edge", "lawn#1", "lawn#9"}


def test_it_is_in_the_help(newcomer: str) -> None:
    text = " ".join(CliRunner().invoke(app, ["plan", "--help"]).output.replace("│", " ").split())
    assert "parallel: straight swaths" in text
    assert f"{newcomer}: rows over the box" in text


def test_an_unknown_method_and_useless_swaths_are_refused() -> None:
    with pytest.raises(PlanningError, match='unknown area method "spiral"; use one of: parallel'):
        plan(lawn(), Vehicle(), PlanOptions(area_method="spiral"))
    for method, problem in ((lambda *_: [], "gets no swaths"), (lambda *_: [Curve(0, 0, 0, 0, 1e-3)], "lawn#1")):
        AREA_METHODS.register("odd", "", method)
        try:
            with pytest.raises(PlanningError, match=problem):
                plan(lawn(), Vehicle(), PlanOptions(area_method="odd"))
        finally:
            AREA_METHODS.forget("odd")


def test_an_area_narrower_than_the_tool_is_refused_by_name() -> None:
    narrow = lawn().model_copy(update={"areas": (box(5.0, 0.1),)})
    with pytest.raises(PlanningError, match=r'area "lawn", which is nowhere as wide as the tool \(0.12 m\)'):
        plan(narrow, Vehicle())


BOX = "[[0,0],[2,0],[2,1],[0,1]]"


@pytest.mark.parametrize(
    ("area", "field", "expected"),
    [
        ('{"id": "a", "outline": [[0,0],[1,1],[1,0],[0,1]]}', "areas[0].outline", "must not cross"),
        ('{"id": "a", "outline": [[0,0],[1,1]]}', "areas[0].outline", "at least 3"),
        (f'{{"id": "a", "outline": {BOX}, "holes": [[[3,3],[4,3],[4,4]]]}}', "areas[0].holes", "inside the outline"),
        (f'{{"id": "a", "outline": {BOX}, "holes": [[[0,0.2],[1,0.2],[1,0.8]]]}}', "areas[0].holes", "not touching"),
        (
            f'{{"id": "a", "outline": {BOX}, "holes": [[[0.2,0.2],[1,0.2],[1,0.8]],[[0.9,0.2],[1.5,0.2],[1,0.8]]]}}',
            "areas[0].holes",
            "apart",
        ),
        (f'{{"id": "a", "outline": {BOX}, "angle_deg": 400}}', "areas[0].angle_deg", "360"),
        (f'{{"id": "a", "outline": {BOX}}}, {{"id": "a", "outline": {BOX}}}', "areas", "share the id"),
    ],
)
def test_bad_areas_are_refused_with_the_field(area: str, field: str, expected: str) -> None:
    with pytest.raises(SpecError, match=expected) as error:
        parse_template(f'{{"name": "n", "areas": [{area}]}}')
    assert error.value.field == field


def test_there_must_be_something_to_paint_and_ids_must_be_told_apart() -> None:
    with pytest.raises(SpecError, match="at least one of segments and areas"):
        parse_template('{"name": "n"}')
    line = '{"id": "a#1", "line": {"start": [0, 0], "end": [1, 0]}}'
    with pytest.raises(SpecError, match="swath of an area"):
        parse_template(f'{{"name": "n", "segments": [{line}], "areas": [{{"id": "a", "outline": {BOX}}}]}}')
    assert parse_template(f'{{"name": "n", "segments": [{line}]}}').segments


def test_an_area_moves_with_the_drawing_and_its_swaths_turn_with_it() -> None:
    there = placed(lawn(angle_deg=20.0), Placement(x_m=5.0, y_m=-2.0, rotation_deg=30.0, mirror=True))
    (area,) = there.areas
    assert area.angle_deg == pytest.approx(10.0)
    assert area.polygon.area == pytest.approx(lawn().areas[0].polygon.area)
    corner = area.outline[1]
    assert corner == pytest.approx((5.0 + 4.0 * math.cos(math.pi / 6), -2.0 + 4.0 * math.sin(math.pi / 6)))
    assert len(parallel(area, WIDTH_M)) == len(parallel(lawn(angle_deg=20.0).areas[0], WIDTH_M))


def test_a_template_reads_back_as_it_was_written() -> None:
    assert parse_template(lawn(angle_deg=20.0).to_json()) == lawn(angle_deg=20.0)
    without = lawn().model_copy(update={"areas": ()})
    assert "areas" not in without.model_dump_json()
    assert "areas" not in without.to_json()
