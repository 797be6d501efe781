"""Ground that a robot has seen: what it keeps, what it takes for gone, and outlines of it."""

import math

import numpy as np
import pytest
import shapely

from touchline.onboard.perception.scan import NOTHING, THING, Beams
from touchline.schemas.known_ground import OPEN_GROUND
from touchline.schemas.vehicles.lidar_spec import LidarSpec
from touchline.services.robot_sim.goal_way.kept_things import KeptThings, PlannedThings, moved_off
from touchline.services.robot_sim.goal_way.seen_ground import SeenGround
from touchline.services.robot_sim.goal_way.way_ahead import WayAhead

LIDAR = LidarSpec(kind="lidar", name="front", beams=360, step_rad=math.pi / 180.0)
FAR_M = 8.0
WALL = ((-2.0, 0.0), (2.0, 0.0))
BODY = np.array([[0.4, 0.3], [-0.4, 0.3], [-0.4, -0.3], [0.4, -0.3]])


def scan(x_m, y_m, *things):
    """A scan from a place; things are lines from point to point."""
    beams = Beams.of(LIDAR)
    lines = shapely.MultiLineString(things)
    for b, (cos, sin) in enumerate(beams.aim):
        ray = shapely.LineString(((x_m, y_m), (x_m + FAR_M * cos, y_m + FAR_M * sin)))
        hit = shapely.intersection(ray, lines)
        range_m = math.inf if hit.is_empty else shapely.distance(shapely.Point(x_m, y_m), hit)
        beams.range_m[b], beams.kind[b] = range_m, NOTHING if hit.is_empty else THING
        beams.rays[b] = x_m, y_m, cos, sin
        beams.points_m[b] = (x_m + min(range_m, FAR_M) * cos, y_m + min(range_m, FAR_M) * sin)
    return beams


@pytest.fixture
def seen():
    """Ground with a wall that was seen from its front for a second."""
    ground, ahead = SeenGround(OPEN_GROUND), scan(0.0, -1.5, WALL)
    for tick in range(10):
        ground.enter(ahead, FAR_M, tick)
    return ground


def test_beams_along_a_wall_do_not_free_it(seen):
    before, beside = len(seen.places_m[1]), scan(3.0, 0.02)
    for tick in range(10, 40):  # past its end, the robot sees beside it: that is how near errors bring the two
        seen.enter(beside, FAR_M, tick)
    assert len(seen.places_m[1]) > 0.9 * before


def test_a_wall_that_has_gone_is_forgotten(seen):
    for tick in range(10, 30):
        seen.enter(scan(0.01 * tick, -1.5), FAR_M, tick)
    assert not len(seen.places_m[1])


def test_beams_along_what_has_gone_free_it_in_the_end(seen):
    before, beside = len(seen.places_m[1]), scan(3.0, 0.02)
    for tick in range(10, 210):
        seen.enter(beside, FAR_M, tick)
    assert len(seen.places_m[1]) < 0.1 * before


def outlined(things, clear):
    """Ground in the outlines of things."""
    outlines = PlannedThings(things, clear).outlines("seen")
    return shapely.union_all([shapely.Polygon(each.corners, each.holes) for each in outlines])


def test_outlines_are_grown_by_what_is_kept_farther_off_and_still_leave_ground_clear(seen):
    clear = shapely.Point(0.0, -1.5).buffer(1.0)
    wall, grown = (outlined(KeptThings(seen.places_m[1], farther_m), clear) for farther_m in (0.0, 0.4))
    assert grown.symmetric_difference(wall.buffer(0.4)).area < 0.03 * grown.area
    cut, grown = (outlined(KeptThings(seen.places_m[1], farther_m), clear.buffer(0.8)) for farther_m in (0.0, 0.4))
    assert cut.area < 0.8 * wall.area
    assert shapely.distance(grown, clear) > 0.35


def test_a_wall_close_to_the_robot_is_moved_off_it_and_stays_closed(seen):
    clear = WayAhead.at((0.0, -0.5, math.pi / 2.0)).swept(BODY, 0.3)
    wall = outlined(KeptThings(seen.places_m[1]), clear)
    assert wall.boundary.distance(shapely.Point(0.0, 0.0)) > 0.3  # a gap as wide as the ground that is clear
    moved_m = moved_off(seen.places_m[1], clear, 0.31)
    wall = outlined(KeptThings(moved_m), clear)
    assert not wall.intersects(clear.buffer(-1e-6))
    left = shapely.box(-1.5, -2.0, 1.5, 2.0).difference(wall.buffer(0.2))  # gaps that no body fits into
    both = (shapely.Point(0.0, -1.9), shapely.Point(0.0, 1.9))
    assert not any(all(part.contains(point) for point in both) for part in shapely.get_parts(left))
