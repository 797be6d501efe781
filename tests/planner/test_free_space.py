"""Free space of a body: proofs against ways, the narrowest place, and ways as they are driven."""

import math

import numpy as np
import pytest
import shapely

from tests.with_full import with_full
from touchline.schemas.catalogue import load_vehicle
from touchline.schemas.errors import PlanningError
from touchline.schemas.known_ground import KnownGround, KnownObstacle
from touchline.schemas.messages import PlanOptions, PoseGoal, WaySearch
from touchline.schemas.vehicles import Vehicle
from touchline.services.planner.free_space.convex_parts import body_parts, convex_parts
from touchline.services.planner.free_space.ground_ways import GroundWays
from touchline.services.planner.free_space.legs import WalledBody
from touchline.services.planner.free_space.narrowest import narrowest_place
from touchline.services.planner.free_space.obstructed_ground import ObstructedGround
from touchline.services.planner.free_space.reachability import Proof, Reachability
from touchline.services.planner.free_space.slices import Slicer
from touchline.services.planner.geometry.clothoid import PathPose
from touchline.services.planner.goal_plan import plan_to_goal
from touchline_research.obstacles.free_worlds import box, placed, random_pose, world

OUTLINE = Vehicle().body.footprint_m
YARD = ((0.0, 0.0), (12.0, 0.0), (12.0, 12.0), (0.0, 12.0))


def yard(gap_m):
    """Square of 12 m with a wall of 0.3 m that leaves a gap at its upper end."""
    wall = ((5.0, 0.0), (5.3, 0.0), (5.3, 12.0 - gap_m), (5.0, 12.0 - gap_m))
    return KnownGround(boundary=YARD, obstacles=(KnownObstacle(id="wall", corners=wall),))


def to_goal(ground, vehicle=None, goal=(9.0, 3.5, 1.57), **options):
    aim = PoseGoal(x_m=goal[0], y_m=goal[1], heading_rad=goal[2])
    asked = PlanOptions(start=[2.5, 4.0, 1.57], **options)
    return plan_to_goal(aim, vehicle or Vehicle(), asked, ground=ground)


def least_distance(plan, ground, outline):
    """Smallest distance of the body from what is kept off, along the trajectory's path."""
    walls = shapely.union_all([shapely.Polygon(each.corners, each.holes) for each in ground.obstacles])
    inside = shapely.Polygon(ground.boundary)
    path = plan.sections[0].path
    poses = np.column_stack(path.sample(np.arange(0.0, path.length_m, 0.02))[:3])
    bodies = [placed(outline, PathPose(*row)) for row in np.concatenate((poses, path.spun(0.02))).tolist()]
    assert shapely.contains(inside, bodies).all()
    return shapely.distance(bodies, shapely.union(walls, inside.exterior)).min()


def test_convex_parts_cover_a_shape_exactly():
    shape = shapely.Polygon(OUTLINE).difference(shapely.box(0.2, -0.1, 0.4, 0.1))
    parts = [shapely.Polygon(part) for part in convex_parts(shape)]
    assert all(part.convex_hull.area == pytest.approx(part.area) for part in parts)
    assert shapely.union_all(parts).symmetric_difference(shape).area < 1e-12
    assert sum(part.area for part in parts) == pytest.approx(shape.area)


@pytest.mark.parametrize("outline", [OUTLINE, load_vehicle("turtlebot2").body.footprint_m])
def test_a_margin_is_hardly_wider_at_the_corners_of_a_body(outline):
    grown = shapely.union_all([shapely.Polygon(part) for part in body_parts(outline, 0.1)])
    body = shapely.Polygon(outline)
    assert body.buffer(0.1, quad_segs=64).difference(grown).area < 1e-9
    assert max(body.distance(shapely.Point(corner)) for corner in shapely.get_coordinates(grown)) < 0.11


def test_a_robot_with_a_corner_beside_a_post_gets_away_with_a_margin():
    post = KnownObstacle(id="post", corners=((0.81, 0.39), (0.9, 0.39), (0.9, 0.48), (0.81, 0.48)))  # 0.085 m from it
    ground = KnownGround(boundary=((-6.0, -3.0), (6.0, -3.0), (6.0, 3.0), (-6.0, 3.0)), obstacles=(post,))
    options, search = PlanOptions(start=[0.0, 0.0, 0.0], margin_m=0.07), WaySearch(quick=True, spare_share=0.9)
    made = plan_to_goal(PoseGoal(x_m=-4.0, y_m=0.0), Vehicle(), options, ground=ground, search=search)
    assert least_distance(made, ground, OUTLINE) > 0.07


@pytest.mark.parametrize(("gap_m", "joined"), [(0.75, True), (0.65, False)])
def test_a_disc_gets_only_through_gaps_that_it_fits_into(gap_m, joined):
    ring = shapely.box(4.0, 4.0, 8.0, 8.0).exterior.buffer(0.1)
    ground = ObstructedGround.of(shapely.Polygon(YARD), [ring.difference(shapely.box(0.0, 5.0, 6.0, 5.0 + gap_m))])
    assert ground.joins((2.0, 4.0), (6.0, 6.0), 0.35) is joined
    assert ground.joins((2.0, 4.0), (10.0, 10.0), 0.35)
    assert not ground.joins((2.0, 4.0), (0.1, 6.0), 0.35)
    assert not ground.joins((0.1, 6.0), (2.0, 4.0), 0.35)


@pytest.mark.parametrize("margin_m", [-0.05, 0.0, 0.1])
def test_the_disc_of_a_body_is_within_it_however_it_is_turned(margin_m):
    body = WalledBody.of(ObstructedGround(shapely.Polygon(YARD)), body_parts(OUTLINE, margin_m))
    grown = shapely.union_all([shapely.Polygon(part) for part in body_parts(OUTLINE, margin_m)])
    assert 0.2 < body.disc_m <= grown.exterior.distance(shapely.Point(0.0, 0.0)) + 1e-12


def test_brackets_hold_what_they_promise():
    """Random poses: free in the tight bracket means free, not in the loose one means not free."""
    ground, rng = world(1), np.random.default_rng(3)
    sliced = Slicer(ground, body_parts(OUTLINE, 0.0)).slice((0.5, 0.5 + math.radians(15.0)))
    tight, loose = shapely.union_all(sliced.tight), shapely.union_all(sliced.loose)
    seen = set()
    for _ in range(600):
        pose = PathPose(*rng.uniform(0.0, 16.0, 2), rng.uniform(*sliced.interval))
        at, free = shapely.Point(pose.x_m, pose.y_m), ground.free.contains(placed(OUTLINE, pose))
        assert free or not tight.contains(at)
        assert not free or loose.intersects(at)
        seen.add((free, tight.contains(at), loose.contains(at)))
    assert len(seen) == 4


@pytest.mark.parametrize("seed", with_full(3, 7, full=(11,)))
def test_what_is_proved_reachable_is_reached_and_nothing_else(seed):
    """Seeds with goals behind a wiggle (3), without a way (7), and a start in a pocket (11)."""
    ground, rng = world(seed), np.random.default_rng(seed + 1000)
    shapely.prepare(ground.free)
    ways, proofs = GroundWays(ground, OUTLINE, 0.0), Reachability(Slicer(ground, body_parts(OUTLINE, 0.0)))
    start = random_pose(rng, ground, OUTLINE)
    for _ in range(5):
        goal = random_pose(rng, ground, OUTLINE)
        proof = proofs.prove(start, goal)
        assert proof is not Proof.UNDECIDED
        if proof is Proof.NONE:
            assert ways.roadmap.way(start, goal) is None
            continue
        legs = ways.legs(start, goal)
        heading = start.heading_rad
        assert legs.places[0, :2] == pytest.approx(start[:2])
        assert legs.places[-1, :2] == pytest.approx(goal[:2])
        for k, turn in enumerate(legs.turns_rad):
            for share in np.linspace(0.0, 1.0, 1 + math.ceil(abs(turn) / 0.1)):
                assert ground.free.contains(placed(OUTLINE, PathPose(*legs.places[k, :2], heading + share * turn)))
            heading += turn
            if k + 1 < len(legs.places):
                ahead = heading_of(legs.places[k + 1, :2] - legs.places[k, :2], legs.places[k + 1, 2])
                assert math.remainder(heading - ahead, math.tau) == pytest.approx(0.0, abs=1e-9)
                for at in np.linspace(legs.places[k, :2], legs.places[k + 1, :2], 9):
                    assert ground.free.contains(placed(OUTLINE, PathPose(*at, heading)))
        assert math.remainder(heading - goal.heading_rad, math.tau) == pytest.approx(0.0, abs=1e-9)


def heading_of(moved, sign):
    return math.atan2(sign * moved[1], sign * moved[0])


@pytest.mark.parametrize(("short_m", "turn"), with_full((0.2, 2.0), full=((0.01, 0.3),)))
def test_the_narrowest_place_and_by_how_much(short_m, turn):
    """A slanting passage as long as the body, too narrow for it."""
    width = 0.83 - short_m
    walls = [box(0.0, sign * (width / 2 + 10.0), 1.5, 20.0, 0.0) for sign in (1, -1)]
    turned = [shapely.affinity.rotate(wall, turn, origin=(0, 0), use_radians=True) for wall in walls]
    ground = ObstructedGround.of(shapely.box(-6.0, -6.0, 6.0, 6.0), turned)
    ends = [PathPose(d * 3.5 * math.cos(turn), d * 3.5 * math.sin(turn), turn + 0.4) for d in (-1, 1)]
    found = narrowest_place(ground, OUTLINE, 0.0, *ends)
    assert found.too_narrow_m == pytest.approx(short_m, abs=0.01)
    assert math.hypot(found.x_m, found.y_m) < 1.0


@pytest.mark.parametrize(
    ("name", "options"),
    [("turf-tank-two", {}), ("turf-tank-two", {"forward_only": True}), ("turtlebot2", {}), ("clay-roller", {})],
)
def test_a_way_round_keeps_the_margin(name, options):
    vehicle, ground = load_vehicle(name), yard(4.0)
    made = to_goal(ground, vehicle, **options)
    assert least_distance(made, ground, vehicle.body.footprint_m) > 0.04
    end = made.sections[0].path.end
    assert (end.x_m, end.y_m) == pytest.approx((9.0, 3.5), abs=1e-6)


def test_open_ground_leaves_a_path_as_it_is():
    aside = KnownGround(boundary=((-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0)))
    assert to_goal(aside).trajectory == to_goal(KnownGround()).trajectory


def test_a_refusal_names_the_narrowest_place():
    with pytest.raises(
        PlanningError, match=r"no way exists .* 0\.05 m round it: .* near \(5\.\d+, 11\.\d+\), is 0\.1[23]"
    ):
        to_goal(yard(0.8))


def test_a_gap_of_the_width_without_margin_is_passed():
    assert least_distance(to_goal(yard(0.87), margin_m=0.0), yard(0.87), OUTLINE) < 0.05


@pytest.mark.parametrize(
    ("ground", "goal", "message"),
    [
        (yard(4.0), (5.1, 3.0, 0.0), 'goal at .* touches "wall"'),
        (yard(4.0), (11.9, 3.0, 0.0), "goal at .* touches the boundary"),
        (yard(0.0), (9.0, 3.5, math.nan), "shut off on all sides"),
    ],
)
def test_goals_that_cannot_be(ground, goal, message):
    with pytest.raises(PlanningError, match=message):
        to_goal(ground, goal=goal)


def test_a_method_that_does_not_go_round_says_so():
    aim = PoseGoal(x_m=9.0, y_m=3.5, heading_rad=0.0, method="cubic")
    with pytest.raises(PlanningError, match="give the method g2, which goes round"):
        plan_to_goal(aim, Vehicle(), PlanOptions(start=[2.5, 4.0, 0.0]), ground=yard(4.0))


def test_a_start_near_a_wall_is_left_with_less_margin():
    near = PlanOptions(start=[4.47, 3.0, math.pi / 2])
    made = plan_to_goal(PoseGoal(x_m=9.0, y_m=3.5), Vehicle(), near, ground=yard(4.0))
    assert 0.0 < least_distance(made, yard(4.0), OUTLINE) <= 0.031
