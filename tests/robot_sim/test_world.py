"""The physics against what can be worked out by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from schemas.scenario import Scenario
from schemas.vehicle import Vehicle
from services.robot_sim.frames import Command
from services.robot_sim.world import body
from services.robot_sim.world.world import Pose, World

QUIET = Scenario(noise="none")
VEHICLE = Vehicle()
AT_ONCE = Vehicle(motor_time_constant_s=0.0, max_wheel_acceleration_radps2=1e9)


def drive(world, command, ticks, first=1):
    for tick in range(first, first + ticks):
        world.step(command, tick)
    return world


def test_a_straight_line_is_straight_and_as_long_as_the_wheels_rolled():
    world = World(AT_ONCE, QUIET)
    world.place(Pose(1.0, 2.0, math.pi / 6))
    drive(world, Command(10.0, 10.0, False, False), 1000)
    length = world.state[body.LEFT_ANGLE] * VEHICLE.wheel_radius_m
    assert length == pytest.approx(10.0, abs=1e-3)  # half a step is lost while the speed steps up
    assert world.pose.east_m == pytest.approx(1.0 + length * math.cos(math.pi / 6), abs=1e-9)
    assert world.pose.north_m == pytest.approx(2.0 + length * math.sin(math.pi / 6), abs=1e-9)
    assert world.pose.heading_rad == math.pi / 6


def test_a_circle_closes_on_its_radius():
    world = World(AT_ONCE, QUIET)
    left, right = 8.0, 12.0
    radius = VEHICLE.half_track_m * (left + right) / (right - left)
    drive(world, Command(left, right, False, False), 1)
    centre = (
        world.pose.east_m - radius * math.sin(world.pose.heading_rad),
        world.pose.north_m + radius * math.cos(world.pose.heading_rad),
    )
    for tick in range(2, 800):
        world.step(Command(left, right, False, False), tick)
        assert math.dist(world.pose[:2], centre) == pytest.approx(radius, abs=1e-9)
    rate = VEHICLE.wheel_radius_m * (right - left) / VEHICLE.track_width_m
    assert world.state[body.YAW_RATE] == pytest.approx(rate, abs=1e-12)
    assert world.state[body.SPEED] == pytest.approx(1.0, abs=1e-12)


def test_a_spin_stays_on_the_spot():
    world = drive(World(AT_ONCE, QUIET), Command(-5.0, 5.0, False, False), 500)
    assert math.hypot(*world.pose[:2]) < 1e-12
    turned = 2 * world.state[body.RIGHT_ANGLE] * VEHICLE.wheel_radius_m / VEHICLE.track_width_m
    assert world.pose.heading_rad == pytest.approx(turned, abs=1e-9)


def test_wheels_obey_lag_and_limits():
    world = World(VEHICLE, QUIET)
    rates = [0.0]
    for tick in range(1, 200):
        world.step(Command(1000.0, -1000.0, False, False), tick)
        rates.append(float(world.state[body.LEFT_RATE]))
        assert world.state[body.RIGHT_RATE] == -rates[-1]
    steps = np.diff(rates)
    assert steps.max() == pytest.approx(VEHICLE.max_wheel_acceleration_radps2 * 0.01)
    assert steps.max() <= VEHICLE.max_wheel_acceleration_radps2 * 0.01 + 1e-9
    assert rates[-1] == pytest.approx(VEHICLE.max_wheel_speed_radps, abs=1e-6)
    assert max(rates) <= VEHICLE.max_wheel_speed_radps


def test_below_the_limits_the_lag_is_first_order():
    world = drive(World(VEHICLE, QUIET), Command(1.0, 1.0, False, False), 5)
    assert world.state[body.LEFT_RATE] == pytest.approx(
        1.0 - math.exp(-0.05 / VEHICLE.motor_time_constant_s), abs=1e-12
    )


def flow_times(world, commands):
    """Milliseconds after the start in which paint flowed."""
    spans = []
    for tick, command in enumerate(commands, start=1):
        world.step(command, tick)
        spans.append(world.trace[1:, body.TRACE_SPRAYING].copy())
    return np.flatnonzero(np.concatenate(spans))


def test_valve_opens_after_15_ms_and_closes_after_30_ms():
    opened = [Command(10.0, 10.0, True, False)] * 10
    closed = [Command(10.0, 10.0, False, False)] * 10
    flowing = flow_times(World(VEHICLE, QUIET), opened + closed)
    assert flowing[0] == 15
    assert flowing[-1] == 100 + 30 - 1
    assert len(flowing) == 115


def test_a_pulse_shorter_than_the_delay_does_nothing():
    pulse = [Command(0.0, 0.0, True, False)] + [Command(0.0, 0.0, False, False)] * 10
    assert len(flow_times(World(VEHICLE, QUIET), pulse)) == 0


def test_disc_takes_its_time():
    world = drive(World(VEHICLE, QUIET), Command(0.0, 0.0, False, True), 49)
    assert world.state[body.DISC_DOWN] == 0.0
    world.step(Command(0.0, 0.0, False, True), 50)
    assert world.state[body.DISC_DOWN] == 1.0


def test_tank_runs_dry_and_then_nothing_flows():
    small = Vehicle(tank_l=0.0077 * 0.1)  # a tenth of a second at painting speed
    flowing = flow_times(World(small, QUIET), [Command(0.0, 0.0, True, False)] * 30)
    assert len(flowing) in (100, 101)
    assert flowing[0] == 15


def test_battery_holds_a_bit_over_five_hours_of_work():
    world = drive(World(VEHICLE, QUIET), Command(10.0, 10.0, False, False), 1000)
    used_wh = VEHICLE.battery_wh - world.state[body.BATTERY_WH]
    hours = VEHICLE.battery_wh / used_wh * 10.0 / 3600.0
    assert 5.0 < hours < 5.5


def test_the_nozzle_is_on_the_right():
    world = World(VEHICLE, QUIET)
    world.place(Pose(3.0, 4.0, math.pi / 2))
    world.step(Command(0.0, 0.0, False, False), 1)
    assert world.trace[-1, :2] == pytest.approx([3.0 + 0.41124, 4.0], abs=1e-12)


def test_trace_is_unbroken():
    world = World(VEHICLE, Scenario(seed=3))
    world.step(Command(9.0, 11.0, True, True), 1)
    end = world.trace[-1, :2].copy()
    world.step(Command(9.0, 11.0, True, True), 2)
    assert world.trace[0, :2] == pytest.approx(end, abs=0)


def test_chassis_errors_and_slip_follow_the_scenario():
    radii = [
        World(VEHICLE, Scenario(seed=seed))._parameters[body.P_LEFT_RADIUS] / VEHICLE.wheel_radius_m - 1
        for seed in range(400)
    ]
    assert np.std(radii) == pytest.approx(0.003, rel=0.15)
    world = World(VEHICLE, Scenario(seed=5))
    slips = []
    for tick in range(1, 20_000):
        world.step(Command(0.0, 0.0, False, False), tick)
        slips.append(float(world.state[body.LEFT_SLIP]))
    assert np.std(slips) == pytest.approx(0.02, rel=0.1)
    lag = 50  # τ = 0.5 s
    assert np.corrcoef(slips[:-lag], slips[lag:])[0, 1] == pytest.approx(math.exp(-1), abs=0.08)


@given(st.floats(-20, 20), st.floats(-20, 20), st.integers(0, 2**62))
def test_whatever_the_command_the_state_stays_finite_and_limited(left, right, seed):
    world = World(VEHICLE, Scenario(seed=seed))
    drive(world, Command(left, right, True, True), 20)
    assert np.isfinite(world.state).all()
    assert abs(world.state[body.LEFT_RATE]) <= 20.0
    assert abs(world.state[body.RIGHT_RATE]) <= 20.0
