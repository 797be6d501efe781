"""The study's zigzag: its angle, its lanes and what they cover."""

import math

import pytest
import shapely
from hypothesis import given

from tests.planner.coverage_fields import PAN, ROLLER, covered_pct
from tests.planner.strategies import floats
from touchline.schemas.errors import PlanningError
from touchline.services.planner.coverage.coverage_route import DriveKind
from touchline.services.planner.coverage.swept_area import body_outside_m
from touchline.services.planner.coverage.zigzag import slide_angle, zigzag

pytestmark = pytest.mark.xdist_group("coverage")  # its kernels are compiled in one worker


@given(floats(0.2, 6.0), floats(1.0, 4.0), floats(0.5, 6.0), floats(0.1, 1.2))
def test_a_slide_leads_to_the_next_lane(width_m: float, overlapping: float, wheelbase_m: float, angle: float) -> None:
    radius = wheelbase_m / math.tan(angle)
    if width_m > 4.0 * overlapping * radius:
        with pytest.raises(PlanningError, match="two turning circles"):
            slide_angle(width_m / overlapping, math.tan(angle) / wheelbase_m)
        return
    beta = slide_angle(width_m / overlapping, math.tan(angle) / wheelbase_m)
    assert 4.0 * radius * math.sin(0.5 * beta) ** 2 == pytest.approx(width_m / overlapping, rel=1e-12)


def test_the_pan_as_published() -> None:
    route = zigzag(PAN, ROLLER)
    assert sum(piece.kind == DriveKind.LANE for piece in route.pieces) == 22
    assert math.degrees(slide_angle(2.2, math.tan(0.5) / 2.0)) == pytest.approx(45.6, abs=0.02)
    assert covered_pct(route, PAN) == pytest.approx(97.6, abs=0.2)
    assert 37.0 <= route.seconds(ROLLER) / 60.0 <= 38.0
    assert route.cusps == 21
    assert body_outside_m([piece.path for piece in route.pieces], ROLLER, PAN) == pytest.approx(2.5, abs=0.05)
    assert any("body is ignored" in remark for remark in route.remarks)
    for before, after in zip(route.pieces, route.pieces[1:], strict=False):
        assert abs(before.path.end.point - after.path.start.point) < 1e-9


def test_it_turns_with_the_field() -> None:
    turned = shapely.affinity.rotate(PAN, 30.0, origin=(0.0, 0.0))
    route = zigzag(turned, ROLLER, angle_rad=math.radians(30.0))
    assert covered_pct(route, turned) == pytest.approx(97.6, abs=0.2)


def test_rolled_twice_everything_is_covered() -> None:
    from touchline.services.planner.coverage.zigzag import ZigzagOptions

    route = zigzag(PAN, ROLLER, ZigzagOptions(overlapping=2.0))
    assert sum(piece.kind == DriveKind.LANE for piece in route.pieces) in (43, 44)
    assert covered_pct(route, PAN) > 99.9
