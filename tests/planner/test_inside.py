"""Keeping inside: the swept body clears every outline, by other transitions if there are any, or the place is named."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from tests.planner.drawn import box, drawn, lines
from tests.planner.strategies import floats
from tests.planner.test_standing import SPINNING, there_and_back
from touchline.schemas.errors import PlanningError
from touchline.schemas.messages import PlanOptions
from touchline.schemas.template import Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.collision.checker import MARGIN_M, CollisionChecker
from touchline.services.planner.geometry.clothoid import PathPose, Piece, PiecePath
from touchline.services.planner.plan import Plan, plan

VEHICLE = Vehicle()
REFUSING = PlanOptions(obstructed="refuse")


def bodies_at(poses: np.ndarray) -> np.ndarray:
    """The body at poses (n, 3), as polygons."""
    corners = np.array(VEHICLE.body.footprint_m) @ (1.0, 1.0j)
    turned = poses[:, :1] + 1j * poses[:, 1:2] + np.exp(1j * poses[:, 2:]) * corners
    return np.asarray(shapely.polygons(np.stack((turned.real, turned.imag), axis=-1)))


def check_clear(planned: Plan, template: Template) -> None:
    """The body every centimetre against the outlines, by shapely."""
    poses = []
    for section in planned.sections:
        station = np.linspace(0.0, section.path.length_m, 2 + int(section.path.length_m / 0.01))
        poses.append(np.column_stack(section.path.sample(station)[:3]))
        for piece, knot in zip(section.path.pieces, section.path.knots, strict=False):
            if piece.spin_rad:
                turned = np.linspace(0.0, piece.spin_rad, 2 + int(abs(piece.spin_rad) / 0.02))
                poses.append(np.column_stack((np.full((len(turned), 2), knot[:2]), knot.heading_rad + turned)))
    bodies = bodies_at(np.concatenate(poses))
    assert template.boundary is None or shapely.contains(shapely.Polygon(template.boundary.corners), bodies).all()
    for obstacle in template.obstacles:
        assert not shapely.intersects(shapely.Polygon(obstacle.corners), bodies).any()


yards = st.builds(
    lambda x, y, size: Template(
        name="checker",
        segments=lines((0, 0, 1, 0)),
        boundary=box((-6, -6), (6, 6)),
        obstacles=(box((x, y), (x + size, y + size), "bench"),),
    ),
    floats(-4, 3),
    floats(-4, 3),
    floats(0.05, 2.0),
)
wanderings = st.builds(
    PiecePath,
    st.builds(PathPose, floats(-4, 4), floats(-4, 4), floats(-math.pi, math.pi)),
    st.lists(
        st.builds(
            Piece,
            floats(0.05, 2.0),
            floats(-2, 2),
            st.sampled_from([0.0, 0.5, -1.0]),
            st.sampled_from([1, -1]),
            st.just(0.0),
        ),
        min_size=1,
        max_size=3,
    ).map(tuple),
)


@given(yards, wanderings)
def test_what_is_called_clear_is_clear_and_what_is_not_is_close(template: Template, path: PiecePath) -> None:
    checker = CollisionChecker.of(template, VEHICLE)
    assert checker is not None
    hit = checker.collision(path)
    assert checker.is_clear(path) == (hit is None)
    boundary = shapely.Polygon(template.boundary.corners)
    bench = shapely.Polygon(template.obstacles[0].corners)
    if hit is None:
        bodies = bodies_at(np.column_stack(path.sample(np.linspace(0.0, path.length_m, 300))[:3]))
        assert shapely.contains(boundary, bodies).all()
        assert not shapely.intersects(bench, bodies).any()
    else:
        (body,) = bodies_at(np.array([hit.pose]))
        outside = not boundary.contains(body) or boundary.exterior.distance(body) < MARGIN_M + 1e-9
        assert outside if hit.outline == "boundary" else bench.distance(body) < MARGIN_M + 1e-9


def test_a_turn_on_the_spot_sweeps_its_corners() -> None:
    post = drawn((0, 0, 1, 0), obstacles=(box((-0.05, 0.7), (0.05, 0.8), "post"),))
    checker = CollisionChecker.of(post, VEHICLE)
    assert checker is not None
    still = PiecePath(PathPose(0.0, 0.0, 0.0), (Piece(0.01),))
    assert checker.collision(still) is None
    hit = checker.collision(PiecePath(PathPose(0.0, 0.0, 0.0), (Piece.spin(2.5), Piece(0.01))))
    assert hit is not None
    assert hit.outline == "post"


def test_without_outlines_nothing_changes() -> None:
    template = drawn((0, 0, 8, 0), (8, 3, 0, 3))
    wide = template.model_copy(update={"boundary": box((-50, -50), (60, 60))})
    assert plan(template, VEHICLE).trajectory == plan(wide, VEHICLE).trajectory


@pytest.mark.parametrize("order", ["given", "optimised"])
def test_transitions_keep_inside_a_boundary_and_off_a_post(order: str) -> None:
    segments = lines((0, 0, 8, 0), (8, 3, 0, 3), (0, 6, 8, 6))
    free = Template(name="checker", segments=segments)
    template = free.model_copy(
        update={"boundary": box((-5.5, -5), (13.5, 11)), "obstacles": (box((9.2, 1.4), (9.4, 1.6), "post"),)}
    )
    planned = plan(template, VEHICLE, PlanOptions(order=order))
    check_clear(planned, template)
    assert planned.report.position_gap_m < 1e-9
    assert planned.report.total_time_s >= plan(free, VEHICLE, PlanOptions(order=order)).report.total_time_s - 1e-6


def test_a_way_round_about_is_found_where_every_direct_one_is_blocked() -> None:
    wall = box((11.0, -1.2), (11.4, 3.2), "wall")
    template = drawn((0, 0, 8, 0), (14, 2, 20, 2), obstacles=(wall,))
    planned = plan(template, VEHICLE, PlanOptions(order="given"))
    check_clear(planned, template)


def test_a_template_outside_its_boundary_is_refused_by_the_first_line() -> None:
    template = drawn((20, 20, 28, 20), boundary=box((-5, -5), (5, 5)))
    with pytest.raises(PlanningError, match=r'segment "s0" cannot be painted: .*"boundary"'):
        plan(template, VEHICLE, REFUSING)


def test_a_line_walled_in_names_what_cannot_be_reached() -> None:
    ring = tuple(
        box(low, high, name)
        for low, high, name in (
            ((-1.2, -1.0), (10.0, -0.9), "south"),
            ((-1.2, 1.6), (10.0, 1.7), "north"),
            ((-1.3, -1.0), (-1.2, 1.7), "west"),
            ((10.0, -1.0), (10.1, 1.7), "east"),
        )
    )
    template = drawn((0, 0, 8, 0), (30, 0, 38, 0), obstacles=ring)
    with pytest.raises(PlanningError, match=r'segment "s\d" (cannot be reached|leaves no room).* would touch'):
        plan(template, VEHICLE, REFUSING, enough=lambda: True)  # other orders are of no use


def test_the_body_is_clear_where_it_reverses_and_turns_on_the_spot() -> None:
    """Between two walls, with a start pose between them too."""
    lane = lines((0, 0, 6, 0), (0, 0.8, 6, 0.8))
    for segments, vehicle in ((lane, VEHICLE), (there_and_back().segments, SPINNING)):
        template = Template(name="lane", segments=segments, boundary=box((-5.9, -0.8), (9.0, 1.5)))
        planned = plan(template, vehicle, PlanOptions(start=[-4.0, 0.5, 0.0]))
        assert planned.report.cusps + planned.report.spins > 0
        check_clear(planned, template)
    # A post where the casters would sweep round: another transition is taken, and it is clear as well.
    post = box((4.6, 0.85), (4.7, 0.95), "post")
    posted = template.model_copy(update={"obstacles": (post,)})
    assert CollisionChecker.of(posted, SPINNING).collision(planned.sections[2].path)
    check_clear(plan(posted, SPINNING, PlanOptions(start=[-4.0, 0.5, 0.0])), posted)
