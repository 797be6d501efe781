"""Lines behind things that no single pose in between leads round."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.planner.drawn import box, drawn
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.collision.checker import CollisionChecker
from touchline.services.planner.collision.via_poses import FAR_BACKED_M, ClosedEnds
from touchline.services.planner.geometry.clothoid import PathPose, PiecePath
from touchline.services.planner.plan import plan
from touchline.services.planner.steering.method import CurveEnd

WALLS = (box((5.0, -8.0), (5.3, 4.5), "1"), box((10.0, -4.5), (10.3, 8.0), "2"), box((15.0, -8.0), (15.3, 4.5), "3"))
FENCE = box((-14.0, -8.0), (34.0, 8.0), "fence")


def test_a_line_behind_three_walls_is_reached() -> None:
    template = drawn((-6.0, 0.0, 1.5, 0.0), (19.0, 0.0, 26.0, 0.0), obstacles=WALLS, boundary=FENCE)
    planned = plan(template, Vehicle(), PlanOptions())
    assert not planned.report.left_out
    checker = CollisionChecker.of(template, Vehicle())
    assert checker is not None
    assert all(checker.is_clear(PiecePath(each.path.start, each.path.pieces)) for each in planned.sections)


def test_of_two_lines_that_no_way_joins_one_is_left_out() -> None:
    room = (box((17.0, -3.0), (28.0, -2.7), "s"), box((17.0, 2.7), (28.0, 3.0), "n"))
    ends = (box((17.0, -3.0), (17.3, 3.0), "w"), box((27.7, -3.0), (28.0, 3.0), "e"))
    template = drawn((-6.0, 0.0, 1.5, 0.0), (19.0, 0.0, 26.0, 0.0), obstacles=(*room, *ends), boundary=FENCE)
    planned = plan(template, Vehicle(), PlanOptions())
    (gap,) = planned.report.left_out
    assert (gap.line_id, gap.from_m, gap.to_m) in {("s0", 0.0, 7.5), ("s1", 0.0, 7.0)}


def test_a_robot_that_is_shut_in_is_told_where() -> None:
    room = (box((-3.0, -3.0), (3.0, -2.7), "s"), box((-3.0, 2.7), (3.0, 3.0), "n"))
    ends = (box((-3.0, -3.0), (-2.7, 3.0), "w"), box((2.7, -3.0), (3.0, 3.0), "e"))
    lines = [(10.0, 4.0 * k, 16.0, 4.0 * k) for k in range(3)]
    template = drawn(*lines, obstacles=(*room, *ends))
    with pytest.raises(PlanningError, match="cannot get away"):
        plan(template, Vehicle(), PlanOptions(start=np.array((0.0, 0.0, 0.0))))


def test_a_robot_leaves_a_slot_in_which_it_cannot_turn() -> None:
    slot = (
        box((-0.4, 0.55), (3.0, 0.8), "n"),
        box((-0.4, -0.8), (3.0, -0.55), "s"),
        box((-0.7, -0.8), (-0.4, 0.8), "w"),
    )
    lines = [(-10.0, y_m, -16.0, y_m) for y_m in (-9.0, 6.0, 9.0)]
    template = drawn(*lines, obstacles=slot)
    planned = plan(template, Vehicle(), PlanOptions(start=np.array((0.0, 0.0, 0.0))))
    assert not planned.report.left_out
    checker = CollisionChecker.of(template, Vehicle())
    assert checker is not None and checker.is_clear(planned.sections[0].path)


def test_a_standing_start_on_the_map_is_not_closed_for_good() -> None:
    goal = CurveEnd(PathPose(9.0, 0.0, 0.0), 0.0)
    standing, painted = (CurveEnd(PathPose(0.0, 0.0, 0.0), 0.0, speed_mps) for speed_mps in (0.0, 1.0))
    closed = ClosedEnds({standing, painted}, {goal})
    ways: Any = SimpleNamespace(leaves=lambda start: True)
    for start in (standing, painted):
        closed.learn(start, goal, {}, ways)
    assert closed.for_good == ({painted}, {goal})


def test_a_goal_without_room_behind_it_does_not_close_a_start_that_can_be_backed_from() -> None:
    start, goal, behind = (CurveEnd(PathPose(x_m, 0.0, 0.0), 0.0) for x_m in (0.0, 9.0, -2.5))
    backing: Any = {(FAR_BACKED_M[0], 0.0): SimpleNamespace(leaving=behind)}
    closed = ClosedEnds({start}, {goal})
    closed.learn(start, goal, backing, None)
    assert closed.for_good == (set(), {goal})
    closed.to_leave.add(behind)
    closed.learn(start, goal, backing, None)
    assert closed.for_good == ({start}, {goal})
