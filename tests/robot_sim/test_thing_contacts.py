"""Contacts of a robot with things: nothing gets through, energy, bumper where it is hit, the same bits on both ways."""

import math

import numpy as np
import pytest

from tests.with_full import with_full
from touchline.onboard.interface import Command
from touchline.schemas.scenario import Scenario
from touchline.schemas.vehicles import Vehicle
from touchline.schemas.vehicles.shipped import SHIPPED
from touchline.services.robot_sim.world.objects import things as t
from touchline.services.robot_sim.world.world import World

AHEAD_M, MASS_KG = 0.75, 56.0
"""Nose of the shipped vehicle, and its mass without paint."""
STOP = Command((0.0, 0.0), False, False, 0.0)


def world_of(*objects, vehicle=None, speed=0.0, **scenario):
    """A robot at the origin that rolls east, its wheels with it, among objects."""
    vehicle = vehicle or Vehicle()
    world = World(vehicle, Scenario(noise="none", objects=objects, **scenario))
    world.state.speed_mps = speed
    if speed:
        world.drive.rate_radps[:] = speed / vehicle.drive.wheel_radius_m
        world.drive.reference_radps[:] = world.drive.rate_radps
    return world


def rolling(speed_mps):
    """Command to keep a speed."""
    return Command((speed_mps / Vehicle().drive.wheel_radius_m,) * 2, False, False, 0.0)


def run(world, seconds, command=STOP):
    """Contacts of some seconds, and the largest depth of anything inside the robot at the end of a tick."""
    contacts, deepest = [], 0.0
    for tick in range(1, round(100 * seconds) + 1):
        world.step(command, tick)
        contacts += world.surroundings.new_contacts(tick)
        deepest = max(deepest, depth(world))
    return contacts, deepest


def depth(world):
    """Greatest depth of anything inside the robot's outline, by shapely."""
    import shapely

    things, (east, north, heading) = world.surroundings.things, world.pose
    cos, sin = math.cos(heading), math.sin(heading)
    body = shapely.Polygon(things.outline[:, :2] @ np.array([(cos, sin), (-sin, cos)]) + (east, north))
    deepest = 0.0
    for row, first, end in zip(things.fixed, things.first[:-1], things.first[1:], strict=True):
        if row[t.F_RADIUS]:
            deepest = max(deepest, row[t.F_RADIUS] - body.distance(shapely.Point(*row[:2])))
            continue
        outline = shapely.Polygon(things.vertices[first:end])
        if body.intersects(outline):
            inside = [
                outline.exterior.distance(p) for p in map(shapely.Point, body.exterior.coords) if outline.contains(p)
            ]
            inside += [
                body.exterior.distance(p) for p in map(shapely.Point, outline.exterior.coords) if body.contains(p)
            ]
            deepest = max([deepest, *inside])
    for mover, own in zip(things.movers, things.figures, strict=True):
        centre = shapely.Point(mover[t.EAST], mover[t.NORTH])
        gap = -body.exterior.distance(centre) if body.contains(centre) else body.distance(centre)
        deepest = max(deepest, own[t.M_RADIUS] - gap)
    return deepest


def test_a_wall_stops_the_robot_where_it_stands():
    world = world_of({"kind": "wall", "x_m": 1.5, "y_m": 0.0, "heading_rad": math.pi / 2, "name": "stand"}, speed=1.4)
    contacts, deepest = run(world, 1.0, rolling(1.4))
    assert deepest < 0.001
    assert world.pose.east_m == pytest.approx(1.5 - 0.075 - AHEAD_M, abs=0.003)
    assert abs(world.state.speed_mps) < 0.02
    first = contacts[0]
    assert first.thing == "stand"
    assert first.robot_mps == pytest.approx(1.4, abs=0.05)
    assert first.closing_mps == first.robot_mps
    assert first.energy_j == pytest.approx(0.5 * MASS_KG * 1.4**2, rel=0.35)  # a corner is hit first, off the middle
    assert world.state.bumper


@pytest.mark.parametrize("seed", with_full(0, 1, full=(2, 3)))
def test_nothing_gets_through_at_any_speed(seed):
    rng = np.random.default_rng(seed)
    for _ in range(25):
        kind = ("post", "wall", "bench", "person", "ball", "dog", "tree", "goal")[int(rng.integers(8))]
        bearing, speed = float(rng.uniform(-0.4, 0.4)), float(rng.uniform(-3, 3))
        away = (1.2 if kind in ("post", "person", "ball", "dog", "tree") else 6.5) * math.copysign(1.0, speed)
        thing = {"kind": kind, "x_m": away * math.cos(bearing), "y_m": away * math.sin(bearing)}
        thing["heading_rad"] = float(rng.uniform(-3, 3))
        if kind in ("person", "dog"):
            thing["motion"] = {"kind": "intercept", "speed_mps": float(rng.uniform(0.2, 3))}
        world = world_of(thing, speed=speed)
        world.state.yaw_rate_radps = float(rng.uniform(-1.5, 1.5))
        _, deepest = run(world, 1.0 if abs(away) < 2 else 2.5, rolling(speed))
        assert deepest < 0.0015, thing


def test_who_runs_into_the_robot_at_rest_is_told_apart_and_presses_on():
    walker = {"kind": "person", "x_m": 3.0, "y_m": 0.1, "motion": {"kind": "intercept", "speed_mps": 1.5}}
    world = world_of(walker)
    contacts, deepest = run(world, 4.0)
    assert [(each.thing, each.robot_mps) for each in contacts] == [("person 0", 0.0)]
    assert contacts[0].closing_mps == pytest.approx(1.5, abs=0.02)
    assert deepest < 0.001
    assert world.state.bumper


def test_driving_into_someone_who_touches_already_is_a_contact_while_moving():
    world = world_of({"kind": "person", "x_m": AHEAD_M + 0.21, "y_m": 0.0, "motion": {"kind": "intercept"}})
    told, _ = run(world, 1.2)
    assert [each.robot_mps for each in told] == [0.0]
    later = []
    for tick in range(121, 171):
        world.step(rolling(1.0), tick)
        later += world.surroundings.new_contacts(tick)
    assert len(later) == 1
    assert later[0].robot_mps > 0.02


@pytest.mark.parametrize("bearing", np.linspace(0.1, math.tau, 6, endpoint=False).tolist())
def test_a_robot_at_rest_that_is_pushed_and_springs_back_has_not_driven_into_anyone(bearing):
    place = {"x_m": 3.0 * math.cos(bearing), "y_m": 3.0 * math.sin(bearing)}
    walks = {"kind": "intercept", "speed_mps": 1.3}
    told, _ = run(world_of({"kind": "dog", **place, "motion": walks}), 4.0)
    assert told and not any(each.robot_mps for each in told)


def test_a_pushed_ball_rolls_on_slows_down_and_presses_no_bumper():
    world = world_of({"kind": "ball", "x_m": 1.0, "y_m": 0.02}, speed=1.0)
    ball, pressed = world.surroundings.things.movers[0], False
    for tick in range(1, 61):
        world.step(rolling(1.0) if tick < 30 else STOP, tick)
        pressed |= world.state.bumper
    assert not pressed
    speed = math.hypot(ball[t.EAST_MPS], ball[t.NORTH_MPS])
    assert 0.7 < speed <= 1.05
    for tick in range(61, 161):
        world.step(STOP, tick)
    assert math.hypot(ball[t.EAST_MPS], ball[t.NORTH_MPS]) == pytest.approx(speed - 0.5, abs=0.01)


def test_a_ball_before_a_wall_is_no_way_through():
    wall = {"kind": "wall", "x_m": 1.6, "y_m": 0.0, "heading_rad": math.pi / 2}
    world = world_of({"kind": "ball", "x_m": 1.0, "y_m": 0.0}, wall, speed=1.0)
    run(world, 3.0, rolling(1.0))
    ball = world.surroundings.things.movers[0]
    beside = abs(ball[t.NORTH]) > 0.4
    assert beside or world.pose.east_m + AHEAD_M < 1.6 - 0.075 - 0.2
    assert ball[t.EAST] < 1.6


def test_tall_grass_is_driven_through():
    world = world_of({"kind": "grass", "x_m": 1.2, "y_m": 0.0}, speed=1.0)
    contacts, _ = run(world, 1.0, rolling(1.0))
    assert not contacts
    assert world.state.speed_mps == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(("y_m", "pressed"), [(0.0, True), (0.7, False)])
def test_a_bumper_strip_feels_its_own_stretch_alone(y_m, pressed):
    nose = {"kind": "bumper-strip", "name": "nose", "from_m": 0.0, "to_m": 0.66}
    vehicle = Vehicle(sensors=[nose])
    x_m = AHEAD_M + 0.2 if y_m == 0.0 else 0.3
    walker = {"kind": "person", "x_m": x_m + 0.1, "y_m": y_m, "motion": {"kind": "intercept"}}
    world = world_of(walker, vehicle=vehicle)
    contacts, _ = run(world, 1.0)
    assert len(contacts) == 1
    assert world.state.bumper == pressed


@pytest.mark.parametrize("motion", ["path", "step", "wander"])
def test_who_runs_into_the_robot_steps_aside_after_a_while(motion):
    motions = {
        "path": {"kind": "path", "points": [[-5.0, 0.0], [5.0, 3.0]], "loop": True},
        "step": {"kind": "step-in-front", "near_m": 9.0},
        "wander": {"kind": "wander", "corner": [-3.0, -1.0], "opposite": [3.0, 1.0]},
    }
    world = world_of({"kind": "person", "x_m": 2.5, "y_m": 0.0, "motion": motions[motion]})
    contacts, deepest = run(world, 40.0)
    assert contacts and deepest < 0.01
    touched = [tick for tick in world.surroundings.things.touched[:, 0].tolist() if tick]
    assert max(touched) < 4000, "nobody stands at the robot for ever"
    east, north, _ = world.pose
    assert math.hypot(east, north) < 0.1, "nor pushes it away"


def test_a_push_moves_the_robot_into_nobody_else():
    standing = {"kind": "person", "x_m": -0.35 - 0.25, "y_m": 0.0}
    comer = {"kind": "person", "x_m": 3.0, "y_m": 0.0, "motion": {"kind": "intercept"}}
    contacts, _ = run(world_of(standing, comer), 8.0)
    assert len(contacts) >= 2 and all(each.robot_mps == 0.0 for each in contacts), contacts


@pytest.mark.parametrize("bearing", [0.31, 0.94, 1.41])
def test_a_light_robot_that_is_pushed_about_for_long_has_driven_into_nobody(bearing):
    comers = (3.0, bearing, 1.2), (-3.0, bearing + 1.0, 1.5)
    people = [
        {
            "kind": "person",
            "x_m": r * math.cos(at),
            "y_m": r * math.sin(at),
            "motion": {"kind": "intercept", "speed_mps": speed},
        }
        for r, at, speed in comers
    ]
    contacts, _ = run(world_of(*people, vehicle=SHIPPED["turtlebot2"].vehicle), 12.0)
    assert len(contacts) >= 2 and all(each.robot_mps == 0.0 for each in contacts), contacts
