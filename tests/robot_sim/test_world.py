"""The physics against what can be worked out by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from touchline.onboard.interface import Command
from touchline.schemas.scenario import Ground, Scenario
from touchline.schemas.vehicles import Motor, Vehicle
from touchline.services.robot_sim.world import body
from touchline.services.robot_sim.world.constants import SURFACES
from touchline.services.robot_sim.world.effects import Effects
from touchline.services.robot_sim.world.world import TruePose, World

QUIET = Scenario(noise="none")
VEHICLE = Vehicle()


def drive(world, command, ticks, first=1, effects=None):
    for tick in range(first, first + ticks):
        world.step(command, tick, effects)
    return world


def level(**ground):
    return Scenario(noise="none", ground=Ground(**ground))


def test_a_straight_line_is_straight_and_as_long_as_the_wheels_rolled_less_their_slip():
    world = World(VEHICLE, QUIET)
    world.place(TruePose(1.0, 2.0, math.pi / 6))
    drive(world, Command((10.0, 10.0), False, False), 1000)
    rolled = world.state.angles_rad[0] * VEHICLE.drive.wheel_radius_m
    length = math.hypot(world.pose.east_m - 1.0, world.pose.north_m - 2.0)
    assert 0.98 * rolled < length < 0.998 * rolled
    assert world.pose.north_m - 2.0 == pytest.approx((world.pose.east_m - 1.0) * math.tan(math.pi / 6), abs=1e-9)
    assert world.pose.heading_rad == math.pi / 6


def test_a_curve_drifts_outward_as_its_lateral_acceleration_asks():
    world = drive(World(VEHICLE, QUIET), Command((8.0, 12.0), False, False), 800)
    speed, yaw_rate = world.state.speed_mps, world.state.yaw_rate_radps
    angle = -world.state.side_speed_mps / speed
    assert angle == pytest.approx(VEHICLE.drive.side_slip_rad_per_mps2 * speed * yaw_rate, rel=0.08)
    nominal = VEHICLE.drive.wheel_radius_m * 4.0 / VEHICLE.drive.track_width_m
    assert 0.96 * nominal < yaw_rate < nominal


def test_a_spin_stays_nearly_on_the_spot():
    world = drive(World(VEHICLE, QUIET), Command((-5.0, 5.0), False, False), 500)
    assert math.hypot(*world.pose[:2]) < 0.05
    turned = 2 * world.state.angles_rad[1] * VEHICLE.drive.wheel_radius_m / VEHICLE.drive.track_width_m
    assert 0.97 * turned < world.pose.heading_rad < turned


def test_wheels_follow_the_profile_of_lag_and_limits():
    world, rates, references = World(VEHICLE, QUIET), [0.0], [0.0]
    for tick in range(1, 200):
        world.step(Command((1000.0, -1000.0), False, False), tick)
        rates.append(float(world.drive.rate_radps[0]))
        references.append(float(world.drive.reference_radps[0]))
        assert world.drive.rate_radps[1] == pytest.approx(-rates[-1], abs=0.3)  # casters pull unevenly
    assert np.diff(references).max() == pytest.approx(VEHICLE.drive.max_wheel_acceleration_radps2 * 0.01)
    assert references[-1] == pytest.approx(VEHICLE.drive.max_wheel_speed_radps, abs=1e-6)
    assert rates[-1] == pytest.approx(VEHICLE.drive.max_wheel_speed_radps, abs=0.05)
    assert np.abs(np.subtract(rates, references)).max() < 1.0


def test_below_the_limits_the_profile_is_first_order_and_the_wheels_are_close_to_it():
    world = drive(World(VEHICLE, QUIET), Command((1.0, 1.0), False, False), 5)
    expected = 1.0 - math.exp(-0.05 / VEHICLE.drive.motor_time_constant_s)
    assert world.drive.reference_radps[0] == pytest.approx(expected, abs=1e-12)
    assert world.drive.rate_radps[0] == pytest.approx(expected, abs=0.1)


@pytest.mark.parametrize("tank_l, power_w", [(20.0, 131.0), (0.0, 98.0)])
def test_power_falls_with_the_paint_and_so_does_the_torque(tank_l, power_w):
    world = World(VEHICLE, QUIET)
    world.state.tank_l = tank_l
    drive(world, Command((10.0, 10.0), False, False), 500)
    assert world.state.power_w == pytest.approx(power_w, rel=0.06)


def test_acceleration_beyond_the_current_limit_is_not_had():
    weak = VEHICLE.changed(drive={"motor": Motor(max_current_a=5.0)})
    world = drive(World(weak, QUIET), Command((20.0, 20.0), False, False), 20)
    torque = 5.0 * 0.08 * 20.0 * 0.85
    assert world.drive.torque_nm[0] == pytest.approx(torque, rel=1e-3)
    assert world.state.speed_mps < 0.25
    drive(world, Command((20.0, 20.0), False, False), 2000)
    assert world.drive.rate_radps[0] == pytest.approx(20.0, abs=0.1)  # and no overshoot from a wound-up integral


def test_too_much_torque_spins_the_wheels_on_wet_grass():
    hasty = VEHICLE.changed(drive={"max_wheel_acceleration_radps2": 400.0, "motor": Motor(max_current_a=100.0)})
    speeds = {}
    for surface in ("grass", "wet-grass"):
        world = drive(World(hasty, level(surface=surface)), Command((20.0, 20.0), False, False), 30)
        speeds[surface] = world.state.speed_mps
        friction = SURFACES[surface].grip * 9.80665 * (1.0 - VEHICLE.drive.caster_load_share)
        assert speeds[surface] < friction * 0.3 * 1.05
    assert speeds["wet-grass"] < 0.75 * speeds["grass"]


def test_a_side_slope_pulls_the_robot_down_and_an_uphill_one_costs_power():
    across = drive(World(VEHICLE, level(grade=0.05, uphill_rad=math.pi / 2)), Command((10.0, 10.0), False, False), 1000)
    angle = -across.state.side_speed_mps / across.state.speed_mps
    assert angle == pytest.approx(VEHICLE.drive.side_slip_rad_per_mps2 * 9.80665 * 0.05, rel=0.1)
    assert across.pose.north_m < -0.02
    assert across.state.mean_accel_y_mps2 == pytest.approx(9.80665 * 0.05, rel=0.02)
    powers = [
        drive(World(VEHICLE, level(grade=0.05, uphill_rad=way)), Command((10.0, 10.0), False, False), 500).state.power_w
        for way in (0.0, math.pi)
    ]
    assert powers[0] - powers[1] > 90.0


def test_on_a_slope_the_map_sees_less_of_the_way_and_the_height_grows():
    world = drive(World(VEHICLE, level(grade=0.15)), Command((10.0, 10.0), False, False), 500)
    flat = drive(World(VEHICLE, QUIET), Command((10.0, 10.0), False, False), 500)
    assert world.pose.east_m < 0.99 * flat.pose.east_m
    assert world.state.height_m == pytest.approx(0.15 * world.pose.east_m)
    state = world.state
    assert math.hypot(state.up_x, state.up_y, state.up_z) == pytest.approx(1.0)
    assert state.up_x == pytest.approx(math.sin(math.atan(0.15)))


def test_a_parked_robot_does_not_creep_down_the_slope():
    world = drive(World(VEHICLE, level(grade=0.1, uphill_rad=1.0)), Command((0.0, 0.0), False, False), 6000)
    assert math.hypot(*world.pose[:2]) < 1e-6


def flow_times(world, commands):
    """Milliseconds after the start in which paint flowed."""
    spans = []
    for tick, command in enumerate(commands, start=1):
        world.step(command, tick)
        spans.append(world.trace[1:, body.TRACE_SPRAYING].copy())
    return np.flatnonzero(np.concatenate(spans))


def test_valve_opens_after_15_ms_and_closes_after_30_ms():
    opened = [Command((10.0, 10.0), True, False)] * 10
    closed = [Command((10.0, 10.0), False, False)] * 10
    flowing = flow_times(World(VEHICLE, QUIET), opened + closed)
    assert flowing[0] == 15
    assert flowing[-1] == 100 + 30 - 1
    assert len(flowing) == 115


def test_a_pulse_shorter_than_the_delay_does_nothing():
    pulse = [Command((0.0, 0.0), True, False)] + [Command((0.0, 0.0), False, False)] * 10
    assert len(flow_times(World(VEHICLE, QUIET), pulse)) == 0


def test_tank_runs_dry_and_then_nothing_flows():
    small = Vehicle(tool={"tank_l": 0.0077 * 0.1})  # a tenth of a second at painting speed
    flowing = flow_times(World(small, QUIET), [Command((0.0, 0.0), True, False)] * 30)
    assert len(flowing) in (100, 101)
    assert flowing[0] == 15


def test_the_band_is_as_wide_as_the_flow_allows():
    world, clogged = World(VEHICLE, QUIET), Effects.sized(2)()
    drive(world, Command((10.0, 10.0), True, False), 5)
    assert world.trace[-1, body.TRACE_SPRAYING] == 1.0
    clogged.flow_share = 0.25
    world.step(Command((10.0, 10.0), True, False), 6, clogged)
    assert world.trace[-1, body.TRACE_SPRAYING] == pytest.approx(0.5)
    assert world.state.flow_lps == pytest.approx(VEHICLE.tool.paint_l_per_m / 4)
    clogged.flow_share = 0.01
    world.step(Command((10.0, 10.0), True, False), 7, clogged)
    assert not world.trace[1:, body.TRACE_SPRAYING].any()


def test_battery_holds_a_bit_over_five_hours_of_work():
    powers = []
    for tank_l in (VEHICLE.tool.tank_l, 0.0):
        world = World(VEHICLE, QUIET)
        world.state.tank_l = tank_l
        drive(world, Command((10.0, 10.0), False, False), 300)
        before = world.state.battery_wh
        drive(world, Command((10.0, 10.0), False, False), 1000, first=301)
        powers.append((before - world.state.battery_wh) * 360.0)
    assert 5.0 < VEHICLE.body.battery_wh / np.mean(powers) < 6.0


def test_trace_is_unbroken():
    world = World(VEHICLE, Scenario(seed=3))
    world.step(Command((9.0, 11.0), True, True), 1)
    end = world.trace[-1, :2].copy()
    world.step(Command((9.0, 11.0), True, True), 2)
    assert world.trace[0, :2] == pytest.approx(end, abs=0)


def test_slip_follows_the_scenario():
    world = World(VEHICLE, Scenario(seed=5))
    slips = []
    for tick in range(1, 20_000):
        world.step(Command((0.0, 0.0), False, False), tick)
        slips.append(float(world.drive.slip[0]))
    assert np.std(slips) == pytest.approx(0.02, rel=0.1)
    lag = 50  # τ = 0.5 s
    assert np.corrcoef(slips[:-lag], slips[lag:])[0, 1] == pytest.approx(math.exp(-1), abs=0.08)


@given(st.floats(-20, 20), st.floats(-20, 20), st.integers(0, 2**62))
def test_whatever_the_command_the_state_stays_finite_and_limited(left, right, seed):
    world = World(VEHICLE, Scenario(seed=seed))
    drive(world, Command((left, right), True, True), 20)
    for value in (*world.state.views.values(), *world.drive.views.values()):
        assert np.isfinite(value).all()
    assert abs(world.drive.rate_radps[0]) <= 20.5
    assert abs(world.drive.rate_radps[1]) <= 20.5
