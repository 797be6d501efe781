"""Ground that a covering tool has been over: the raster against exact polygons, and cases worked out by hand."""

import math

import numpy as np
import pytest
import shapely

from tests.robot_sim.rolled import BODY, WIDTH_M, Rolled, bend, field, line, path_of
from touchline.schemas.curves import Curve
from touchline.schemas.template import Area, Polygon, Template
from touchline.services.robot_sim.accounting import area_raster
from touchline.services.robot_sim.accounting.area_raster import AreaRaster
from touchline.services.robot_sim.accounting.body_outside import body_outside_m
from touchline.services.robot_sim.accounting.planned_tool_path import planned_tool_path
from touchline.services.robot_sim.accounting.swept_ground import swept_ground
from touchline.services.robot_sim.paint.ledger import PaintLedger, PaintStroke

POND = ((8.53, 3.51), (10.52, 3.9), (9.8, 5.03))


def turned(points, angle=0.3711, about=(10.0, 5.0)):
    cos, sin = math.cos(angle), math.sin(angle)
    x, y = (np.asarray(points) - about).T
    return np.column_stack((cos * x - sin * y, sin * x + cos * y)) + about


def wander(rolled):
    """Lanes, turns to both sides, a cusp, a pause: over the edge and over itself."""
    first = bend(2.0, 1.3, 0.0, 0.0, 12.0)
    around = bend(14.0, 1.3, 0.0, 0.27, math.pi / 0.27)
    back = bend(*around[-1], math.pi, 0.0, 9.0)
    rolled.along(np.vstack((first, around[1:], back[1:])), stop=False)
    end = back[-1]
    slide = bend(end[0], end[1], 0.0, 0.2, 5.0)
    rolled.along(slide, backward=True, stop=True)
    return rolled.along(bend(*slide[-1], 1.0, -0.25, 14.0))


def test_the_raster_is_that_of_the_exact_polygons() -> None:
    outline = turned(((0.0, 0.0), (20.0, 0.0), (20.0, 10.0), (12.0, 6.0), (0.0, 10.0)))
    template = Template(name="pan", areas=(Area(id="pan", outline=outline.tolist(), holes=(POND,)),))
    rolled = wander(Rolled(template))
    raster = AreaRaster([area.polygon for area in template.areas], WIDTH_M, 0.025)
    raster.take(rolled.ledger.rows(0))
    area = template.areas[0].polygon
    swept, twice = swept_ground(rolled.ledger.strokes())
    cell_m2 = raster.cell_m**2
    assert sum(raster.cells) * cell_m2 == pytest.approx(area.area, rel=2e-4)
    covered = float(swept.intersection(area).area)
    assert sum(raster.covered) * cell_m2 == pytest.approx(covered, abs=2e-4 * area.area)
    assert sum(raster.overlapped) * cell_m2 == pytest.approx(float(twice.intersection(area).area), abs=2e-4 * area.area)
    assert 0.3 * area.area < covered < 0.8 * area.area
    assert raster.times.max() >= 2


def test_it_does_not_matter_when_the_raster_looks() -> None:
    template = field()
    rolled = wander(Rolled(template))
    rows = rolled.ledger.rows(0)
    at_once, bit_by_bit = (AreaRaster([template.areas[0].polygon], WIDTH_M) for _ in range(2))
    at_once.take(rows)
    for end in range(0, len(rows) + 7, 7):
        bit_by_bit.take(rows[:end])
    assert (at_once.times == bit_by_bit.times).all()
    assert at_once.covered == bit_by_bit.covered


@pytest.mark.parametrize("angle", [0.0, 0.9, math.pi / 2])
def test_a_gap_between_two_lanes_is_as_wide_as_it_is(angle: float) -> None:
    gap_m, length_m = 0.10, 15.0
    rolled = Rolled(field(30.0, 30.0))
    for aside in (0.0, WIDTH_M + gap_m):
        lane = turned(line((5.0, 12.0 + aside), (5.0 + length_m, 12.0 + aside)), angle, (15.0, 15.0))
        rolled.along(lane if aside == 0.0 else lane[::-1])
    box = turned(((5.0, 12.0), (20.0, 12.0), (20.0, 14.3), (5.0, 14.3)), angle, (15.0, 15.0))
    between = Template(name="between", areas=(Area(id="between", outline=box.tolist()),))
    watched = Rolled(between)
    watched.ledger.restore(rolled.ledger.rows(0))
    found = watched.metrics()
    assert found.missed_m2 == pytest.approx(gap_m * length_m, rel=0.01)
    (patch,) = found.missed
    assert patch.area_m2 == pytest.approx(gap_m * length_m, rel=0.01)
    assert watched.account.template.areas[0].polygon.contains(shapely.Point(patch.x_m, patch.y_m))
    standing = watched.standing()
    assert standing.area_m2 - standing.covered_m2 == pytest.approx(gap_m * length_m, rel=0.15)


def test_a_long_bend_leaves_no_slivers_where_its_strip_is_cut() -> None:
    rolled = Rolled(field()).along(bend(10.0, 1.3, 0.0, 0.27, 1.2 * math.pi / 0.27))
    swept, twice = swept_ground(rolled.ledger.strokes())
    assert swept.area == pytest.approx(1.2 * math.pi / 0.27 * WIDTH_M, rel=1e-4)
    assert swept.geom_type == "Polygon" and not swept.interiors
    left = shapely.difference(swept.buffer(0.02, join_style="mitre").buffer(-0.02, join_style="mitre"), swept)
    assert left.area < 1e-4
    assert twice.area < 0.01


@pytest.mark.parametrize("radius_m", [0.004, 0.1])
def test_where_the_tool_turns_almost_on_the_spot_the_ground_that_it_came_over_stays_covered(radius_m: float) -> None:
    angles = np.linspace(0.0, 1.4, 7)[1:]
    turn = np.column_stack((3.0 + radius_m * np.sin(angles), radius_m * (1.0 - np.cos(angles))))
    swept = swept_ground([PaintStroke(np.vstack((line((0.0, 0.0), (3.0, 0.0)), turn)), 1.0)]).swept
    assert shapely.box(0.0, -0.5, 3.0, 0.5).difference(swept).area < 1e-3


def test_lanes_that_touch_leave_nothing_and_overlap_nowhere_but_where_they_lie_over_one_another() -> None:
    rolled = Rolled(field(20.0, 2.0 * WIDTH_M))
    rolled.along(line((-1.0, 1.1), (21.0, 1.1)))
    rolled.along(line((21.0, 3.3), (-1.0, 3.3)))
    found = rolled.metrics()
    assert (found.coverage_pct, found.missed) == (pytest.approx(100.0), [])
    assert found.overlap_m2 == pytest.approx(0.0, abs=1e-6)
    assert found.beside_m2 == pytest.approx(4 * WIDTH_M)
    standing = rolled.standing()
    assert (standing.coverage_pct, standing.overlap_m2) == (100.0, 0.0)
    rolled.along(line((5.0, 1.1), (9.0, 1.1)))
    assert rolled.metrics().overlap_m2 == pytest.approx(4.0 * WIDTH_M)
    assert rolled.standing().overlap_m2 == pytest.approx(4.0 * WIDTH_M, rel=0.01)


def test_a_way_forward_and_back_again_is_rolled_twice() -> None:
    rolled = Rolled(field())
    rolled.along(line((2.0, 5.0), (8.0, 5.0)), stop=False).along(line((8.0, 5.0), (4.0, 5.0)), backward=True)
    assert rolled.metrics().overlap_m2 == pytest.approx(4.0 * WIDTH_M, rel=1e-4)
    assert rolled.standing().overlap_m2 == pytest.approx(4.0 * WIDTH_M, rel=0.02)
    assert rolled.standing().covered_m2 == pytest.approx(6.0 * WIDTH_M, rel=0.02)


def test_figures_of_a_restored_ledger_are_those_of_the_one_that_went_on() -> None:
    whole, first = Rolled(field()), Rolled(field())
    ways = [line((1.0, 1.2), (19.0, 1.2)), line((19.0, 3.4), (1.0, 3.4)), bend(2.0, 6.0, 0.0, 0.2, 12.0)]
    for way in ways:
        whole.along(way)
    for way in ways[:2]:
        first.along(way)
    second = Rolled(field())
    second.ledger.restore(first.ledger.rows(0))
    second.along(ways[2])
    assert second.standing() == whole.standing()
    assert second.metrics()._replace(body_outside_m=0.0) == whole.metrics()._replace(body_outside_m=0.0)


def test_shares_of_several_areas_and_of_the_plan() -> None:
    west, east = (((x, 0.0), (x + 10.0, 0.0), (x + 10.0, 2.2), (x, 2.2)) for x in (0.0, 12.0))
    template = Template(name="two", areas=(Area(id="west", outline=west), Area(id="east", outline=east)))
    rolled = Rolled(template, path_of(Curve.from_line((0.0, 1.1), (20.0, 1.1))))
    rolled.along(line((0.0, 1.2), (17.0, 1.2)))
    rolled.standing()
    assert rolled.account.ids == ("west", "east")
    assert rolled.account.fractions == [pytest.approx(2.1 / 2.2, abs=0.03), pytest.approx(0.5 * 2.1 / 2.2, abs=0.03)]
    found = rolled.metrics()
    assert found.planned_m2 == pytest.approx(18.0 * 2.2)
    assert found.of_planned_pct == pytest.approx(100.0 * 15.0 * 2.1 / (18.0 * 2.2))
    assert found.lateral.mean_m == pytest.approx(0.1) and found.lateral.max_m == pytest.approx(0.1)
    assert not found.verdict.accepted
    assert found.verdict.text == "79.55 % of what the plan covers is covered, 99 % is asked for"


def test_the_planned_path_is_cut_where_it_turns_back() -> None:
    forward = path_of(Curve.from_line((0.0, 0.0), (5.0, 0.0)), Curve(5.0, 0.0, 0.0, 0.25, 4.0)).path.segments
    back = path_of(Curve.from_line((8.0, 3.0), (2.0, 3.0)), direction=-1).path.segments
    both = path_of().model_copy(update={"path": path_of().path.model_copy(update={"segments": (*forward, *back)})})
    way = planned_tool_path(both, Rolled(field()).vehicle)
    assert [len(stretch.points) > 2 for stretch in way] == [True, False]
    assert swept_ground(way).swept.area == pytest.approx(9.0 * WIDTH_M + 6.0 * WIDTH_M, rel=0.3)


def outside(poses, template):
    rows = np.zeros((len(poses), 5))
    rows[:, 1:4] = poses
    return body_outside_m(rows, BODY, template)


def test_how_far_the_body_gets_beyond_the_boundary_and_into_obstacles() -> None:
    template = field()
    assert outside([(10.0, 5.0, 0.3), (2.5, 5.0, 0.0), (19.6, 5.0, 0.0)], template) == 0.0
    assert outside([(10.0, 5.0, 0.0), (2.0, 5.0, 0.0), (2.2, 5.0, 0.0)], template) == pytest.approx(0.5)  # the tail
    assert outside([(19.7, 5.0, 0.0)], template) == pytest.approx(0.1)  # the nose
    tail = math.hypot(2.5, 0.6) * math.sin(0.5 + math.atan2(0.6, 2.5))
    assert outside([(10.0, 1.0, 0.5)], template) == pytest.approx(tail - 1.0)
    # Beyond a corner that reaches in, no corner of the body need be outside.
    notched = ((0.0, 0.0), (9.0, 0.0), (10.0, 4.9), (11.0, 0.0), (20.0, 0.0), (20.0, 10.0), (0.0, 10.0))
    into = template.model_copy(update={"boundary": Polygon(corners=notched)})
    assert outside([(11.0, 5.0, 0.0)], into) == pytest.approx(0.08, abs=0.01)
    post = Polygon(id="post", corners=((9.0, 5.3), (9.2, 5.3), (9.2, 5.9), (9.0, 5.9)))
    posted = template.model_copy(update={"obstacles": (post,)})
    assert outside([(10.0, 5.0, 0.0)], posted) == pytest.approx(0.1, abs=0.01)
    assert outside([(12.0, 5.0, 0.0)], posted.model_copy(update={"boundary": None})) == 0.0


def test_what_can_be_reached_is_less_by_what_the_nose_keeps_from_the_corners() -> None:
    found = Rolled(field(93.0, 47.6)).metrics()
    assert found.reachable_m2 == pytest.approx(93.0 * 47.6 * (1.0 - 1.5e-4), rel=3e-5)
    assert Rolled(field(2.1, 9.0)).metrics().reachable_m2 == 0.0  # it does not even fit in
    pond = Polygon(id="pond", corners=((8.0, 4.0), (12.0, 4.0), (12.0, 6.0), (8.0, 6.0)))
    beside = Rolled(field(obstacles=(pond,))).metrics()
    assert beside.reachable_m2 == pytest.approx(200.0 - 8.0, rel=0.01)
    assert beside.reachable_m2 < 192.0


def test_much_ground_is_counted_in_larger_cells(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(area_raster, "MOST_CELLS", 10_000)
    raster = AreaRaster([shapely.box(0.0, 0.0, 40.0, 25.0)], WIDTH_M)
    assert raster.times.size < 10_300
    assert sum(raster.cells) * raster.cell_m**2 == pytest.approx(1000.0, rel=0.01)


def test_nothing_rolled_is_nothing_covered() -> None:
    rolled = Rolled(field())
    found = rolled.metrics()
    assert (found.covered_m2, found.coverage_pct, found.missed_m2, found.overlap_m2) == (0.0, 0.0, 200.0, 0.0)
    assert [patch.area_m2 for patch in found.missed] == [200.0]
    assert rolled.standing().coverage_pct == 0.0
    assert PaintLedger([], 0.12, WIDTH_M).strokes() == []
