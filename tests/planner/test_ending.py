"""Ends of drives: behind the last line, at a given pose, or at the start."""

import math

import numpy as np
import pytest

from tests.planner.drawn import box, drawn
from touchline.schemas.catalogue import load_template
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.collision.checker import CollisionChecker
from touchline.services.planner.plan import Plan, plan

VEHICLE = Vehicle()


def row(count: int = 4) -> Template:
    """Lines one behind the other along x."""
    return drawn(*((20.0 * k, 0.0, 20.0 * k + 5.0, 0.0) for k in range(count)))


def ends(planned: Plan) -> tuple[np.ndarray, np.ndarray]:
    """The first and the last pose, headings as directions."""
    poses = planned.sections[0].path.start, planned.sections[-1].path.end
    first, last = (np.array([p.x_m, p.y_m, math.cos(p.heading_rad), math.sin(p.heading_rad)]) for p in poses)
    return first, last


@pytest.mark.parametrize("order", ["given", "optimised"])
@pytest.mark.parametrize("start", [[], [-10.0, 3.0, 1.0]])
def test_the_robot_returns_to_where_it_began(order: str, start: list[float]) -> None:
    options = PlanOptions(order=order, start=start, return_to_start=True)
    planned = plan(row(), VEHICLE, options)
    first, last = ends(planned)
    assert np.allclose(first, last, atol=1e-9)
    assert planned.report.position_gap_m < 1e-9
    assert planned.speeds.speed_mps[-1] == 0.0
    # All lines are painted at the speed that they are painted at without.
    assert planned.report.paint_time_s == pytest.approx(plan(row(), VEHICLE).report.paint_time_s)


def test_a_given_end_decides_what_is_painted_last() -> None:
    for end, last in (([-10.0, 0.4, math.pi], "s0"), ([80.0, 0.4, 0.0], "s3")):
        planned = plan(row(), VEHICLE, PlanOptions(end=end))
        assert planned.painted[-1].segment_id == last
        assert np.allclose(ends(planned)[1], [end[0], end[1], math.cos(end[2]), math.sin(end[2])], atol=1e-9)


def test_a_closed_order_takes_less_time_than_going_home_from_an_open_one() -> None:
    template = load_template("soccer-7")
    options = PlanOptions(drying_time_s=1e-3)
    open_end = plan(template, VEHICLE, options)
    closed = plan(template, VEHICLE, options.model_copy(update={"return_to_start": True}))
    first, last = ends(open_end)
    home_s = float(np.hypot(*(first - last)[:2])) / VEHICLE.drive.transit_speed_mps
    assert open_end.report.total_time_s < closed.report.total_time_s < open_end.report.total_time_s + home_s


def test_the_way_home_keeps_off_obstacles() -> None:
    template = row(2).model_copy(update={"obstacles": (box((30.0, -6.0), (31.0, 6.0), "bench"),)})
    start = [40.0, 8.0, 0.0]
    planned = plan(template.model_copy(update={"segments": template.segments[:1]}), VEHICLE, PlanOptions(end=start))
    checker = CollisionChecker.of(template, VEHICLE)
    assert checker
    assert not any(checker.collision(section.path) for section in planned.sections)


def test_two_ends_or_half_a_pose_are_refused() -> None:
    with pytest.raises(PlanningError, match="give one of them"):
        plan(row(), VEHICLE, PlanOptions(end=[0.0, 0.0, 0.0], return_to_start=True))
    with pytest.raises(PlanningError, match="unusable end pose"):
        plan(row(), VEHICLE, PlanOptions(end=[0.0, 0.0]))
