"""The fence: a template's boundary or the plan's surroundings, for the whole body."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.onboard.rig import Rig, chain, trajectory
from tests.two_wheels import STANDSTILL
from touchline.onboard import filter_model as m
from touchline.onboard.computer_state import ComputerState
from touchline.onboard.executive.failsafe import Failsafe
from touchline.onboard.executive.geofence import Geofence, beyond_m
from touchline.onboard.trajectory.path import cut_path
from touchline.schemas.errors import CommandRefused
from touchline.schemas.messages import TraversalStatus
from touchline.schemas.onboard import FenceLimits, OnboardConfig
from touchline.schemas.scenario import Scenario
from touchline.schemas.template import Polygon, Template
from touchline.schemas.vehicles import Vehicle
from touchline.services.robot_sim.emulator import Emulator
from touchline.services.robot_sim.world.world import TruePose

VEHICLE = Vehicle()
ESTOPPED, RUNNING, DONE = TraversalStatus.ESTOPPED, TraversalStatus.RUNNING, TraversalStatus.DONE
BENT = trajectory(chain((0.0, 6.0), (0.5, 2.0 * math.pi), (0.0, 6.0)))
LINE = trajectory(chain((0.0, 12.0)), sprays=((5.0, 10.0),))
ELL = ((0.0, 0.0), (10.0, 0.0), (10.0, 4.0), (4.0, 4.0), (4.0, 10.0), (0.0, 10.0))


def fence(plan=BENT, boundary=(), **limits):
    rows, _ = cut_path(plan.path.segments, VEHICLE)
    return Geofence(rows, boundary, VEHICLE, FenceLimits(**limits))


@settings(deadline=None)
@given(st.floats(-3, 13), st.floats(-3, 13), st.floats(-4, 4))
def test_the_body_beyond_an_outline_is_what_shapely_says(east: float, north: float, heading: float) -> None:
    outline, body = np.array(ELL), np.array(VEHICLE.body.footprint_m)
    turn = np.array([[math.cos(heading), math.sin(heading)], [-math.sin(heading), math.cos(heading)]])
    corners = shapely.points(body @ turn + (east, north))
    expected = float(shapely.distance(shapely.Polygon(ELL), corners).max())
    radius = float(np.hypot(*body.T).max())
    found = beyond_m(outline, body, radius, east, north, heading)
    assert max(found, 0.0) == pytest.approx(expected, abs=1e-9)


def test_without_a_boundary_it_is_the_hull_of_what_the_body_sweeps() -> None:
    surroundings = fence()
    hull = shapely.Polygon(surroundings.outline)
    assert hull.is_valid and hull.equals(hull.convex_hull)
    for s in np.linspace(0.0, 6.0, 50).tolist():
        assert surroundings.beyond_m(s, 0.0, 0.0) <= 1e-9
        assert surroundings.beyond_m(s, 4.0, math.pi) <= 1e-9
    assert surroundings.beyond_m(-2.0, 0.0, 0.0) == pytest.approx(2.0, abs=0.02)
    box = shapely.box(*hull.bounds)
    assert box.area - hull.area > 0.5, "corners that the robot does not come near are not inside"


def test_a_plan_that_leaves_the_boundary_is_refused() -> None:
    plan = trajectory(chain((0.0, 8.0), x=1.0, y=2.0))
    assert fence(plan, ELL).name == "the template's boundary"
    out = trajectory(chain((0.0, 8.0), x=2.0, y=2.0))
    with pytest.raises(CommandRefused, match=r"over the template's boundary"):
        fence(out, ELL)
    assert fence(out, ELL, boundary_margin_m=1.0).margin_m == 1.0


def emulator(boundary=None, **limits):
    template = Template(
        name="one",
        segments=[{"id": "s", "line": {"start": (5.0, -0.41124), "end": (10.0, -0.41124)}}],
        boundary=Polygon(corners=boundary) if boundary else None,
    )
    robot = Emulator(
        VEHICLE, Scenario(noise="none"), OnboardConfig(follower="pure-pursuit", fence=FenceLimits(**limits))
    )
    robot.load(LINE, template)
    robot.start()
    return robot


NEAR = ((-1.0, -1.0), (13.0, -1.0), (13.0, 0.6), (-1.0, 0.6))


def pushed(robot, north_m, at_m=3.0):
    """Ticks from a push to the side to the emergency stop; None if it goes on."""
    while robot.onboard.status.arc_length_m < at_m:
        robot.tick()
    east, north, heading = robot.world.pose
    robot.world.place(TruePose(east, north + north_m, heading))
    estimator = robot.onboard._estimator
    estimator.ring.states[:, 1] += north_m  # it knows: what is tested is the fence, not what the filter makes of a jump
    for ticks in range(1, 100):
        robot.tick()
        if robot.onboard.state == ESTOPPED:
            return ticks
    return None


@pytest.mark.parametrize(
    ("boundary", "limits", "push_m", "stops_after"),
    [
        (NEAR, {}, 0.34, None),  # 7 cm over it
        (NEAR, {}, 0.42, 20),
        (NEAR, {"boundary_margin_m": 0.5}, 0.42, None),
        (NEAR, {"boundary_margin_m": 0.0, "timeout_s": 0.5}, 0.34, 50),
        (None, {}, 1.8, None),
        (None, {}, 2.3, 20),
        (None, {"margin_m": 0.2}, 0.3, 20),
    ],
)
def test_over_the_fence_it_stops_hard_after_the_time_out(boundary, limits, push_m, stops_after) -> None:
    robot = emulator(boundary, **limits)
    assert pushed(robot, push_m) == stops_after
    if stops_after is not None:
        name = "the template's boundary" if boundary else "its plan's surroundings"
        assert f"has left {name}" in robot.onboard.status.reason
        assert robot.command[:2] == ((0.0, 0.0), False)


@pytest.mark.parametrize(("sigma_rad", "stops"), [(0.0, True), (0.02, True), (0.1, False)])
def test_a_body_that_may_be_turned_is_not_yet_beyond_the_fence(sigma_rad: float, stops: bool) -> None:
    """Two σ of the heading at the farthest corner, some 80 cm away, are added to the margin."""
    surroundings = fence(margin_m=0.1)
    robot = ComputerState.sized(2)()
    robot.times.first_tick = 0
    south_m = surroundings.outline[:, 1].min() - min(y for _, y in VEHICLE.body.footprint_m) - 0.17
    robot.filter.states[:, m.NORTH] = south_m
    robot.filter.covariances[:, m.HEADING, m.HEADING] = sigma_rad**2
    hazards = Failsafe(VEHICLE, robot, 0.2)
    hazards.fence = surroundings
    rig = Rig()
    for _ in range(25):
        frame = rig.step(STANDSTILL)
        robot.frame.fill(frame)
        hazards.look(frame.tick)
    assert bool(hazards.emergency) is stops
